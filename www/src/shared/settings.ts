/** Attribute values, checked. Each parser throws a `PhotoError` that names what it would take. */

import type { Look } from '../engine/output-settings.js';
import { PhotoError } from './errors.js';
import { type Backend, type Gamut, LIGHTS, type LightName, type ToneCurve } from './names.js';

export { LIGHTS, type LightName } from './names.js';

/** The back ends, the fastest first: the order in which they are tried. */
export const BACKENDS: readonly [Backend, ...Backend[]] = ['webgpu', 'webgl2', 'cpu'];

/** A position on the picture: 0, 0 is the top left corner and 1, 1 the bottom right. */
export interface PicturePoint {
  readonly x: number;
  readonly y: number;
}

/** The middle of the picture. */
export const CENTRE: PicturePoint = { x: 0.5, y: 0.5 };

const DEFAULT_EXPOSURE = 1;
const TONES = ['clip', 'filmic'] as const;
const GAMUTS = ['srgb', 'display-p3'] as const;
const LOADINGS = ['auto', 'lazy', 'eager'] as const;
const REVEALS = ['auto', 'interaction', 'manual'] as const;
/** More than any picture needs, and little enough for the module, which computes in 32-bit floats. */
export const MAX_EXPOSURE = 1e30;
const MAX_FACTOR = 1000;
/** Of the light plane's shorter side: the whole of it shines alike by then. */
export const MAX_SIZE = 100;
/** What the module takes for a torch whose size is left out. */
export const DEFAULT_SIZE = 1 / 7;
/** `zoom` and `kiosk` without a value. */
const ZOOM = 8;
const KIOSK_SECONDS = 60;
const MAX_ZOOM = 100;
/** A day: timers of browsers count no farther than some weeks. */
const MAX_KIOSK_SECONDS = 86_400;

/** When the photograph is fetched. */
export type Loading = (typeof LOADINGS)[number];
/** When the poster gives way. */
export type Reveal = (typeof REVEALS)[number];

/** The `light` attribute; flood where there is none. */
export function parseLight(value: string | null): LightName {
  return oneOf(value, LIGHTS, 'light');
}

/** The `backend` attribute, a list in order of preference; `null` where there is none. */
export function parseBackends(value: string | null): readonly Backend[] | null {
  const names = value?.split(/[\s,]+/).filter(Boolean) ?? [];
  if (names.length === 0) return null;
  return [...new Set(names.map((name) => oneOf(name, BACKENDS, 'back end')))];
}

/** The `exposure` attribute, a factor on the light's brightness; 1 where there is none. */
export function parseExposure(value: string | null): number {
  const right = '1 shows the photograph as taken';
  return parseNumber(value, 'exposure', 0, MAX_EXPOSURE, right) ?? DEFAULT_EXPOSURE;
}

/** The `light-size` attribute, the torch's radius; `null` where there is none. */
export function parseSize(value: string | null): number | null {
  const what = 'light size';
  const right = 'it is a fraction of the light’s shorter side';
  return parseNumber(value, what, 1e-6, MAX_SIZE, right);
}

/** The `light-x` or `light-y` attribute; `null` where there is none. */
export function parsePlace(value: string | null, name: string): number | null {
  return parseNumber(value, name, 0, 1, '0 is the picture’s left or upper edge');
}

/** The `zoom` attribute, the furthest magnification: 1, which is none, where there is none. */
export function parseZoom(value: string | null): number {
  if (value?.trim() === '') return ZOOM;
  return parseNumber(value, 'zoom', 1, MAX_ZOOM, '1 shows all of the picture') ?? 1;
}

/** The `kiosk` attribute, in seconds: 0, which is never, where there is none. */
export function parseKiosk(value: string | null): number {
  if (value?.trim() === '') return KIOSK_SECONDS;
  return parseNumber(value, 'kiosk', 0, MAX_KIOSK_SECONDS, 'they are seconds, 0 is never') ?? 0;
}

/** A number; `null` where there is none. `right` is what helps to find the right one. */
function parseNumber(
  value: string | null,
  what: string,
  least: number,
  most: number,
  right: string,
): number | null {
  if (value === null || value.trim() === '') return null;
  const number = Number(value);
  if (number >= least && number <= most) return number;
  throw new PhotoError(
    'attribute',
    `The ${what} “${value}” is not a number from ${least} to ${most}; ${right}.`,
  );
}

/** The `white-balance` attribute, factors on red, green and blue; none of them where there is none. */
export function parseWhiteBalance(value: string | null): Look['whiteBalance'] {
  if (value === null || value.trim() === '') return [1, 1, 1];
  const factors = value
    .trim()
    .split(/[\s,]+/)
    .map(Number);
  const [red, green, blue] = factors;
  const fit =
    factors.length === 3 && factors.every((factor) => factor >= 0 && factor <= MAX_FACTOR);
  if (fit && red !== undefined && green !== undefined && blue !== undefined) {
    return [red, green, blue];
  }
  throw new PhotoError(
    'attribute',
    `The white balance “${value}” is not three numbers from 0 to ${MAX_FACTOR}, for red, green and ` +
      'blue; “1 1 1” shows the photograph as taken.',
  );
}

/** The `tone` attribute; `clip` where there is none. */
export function parseTone(value: string | null): ToneCurve {
  return oneOf(value, TONES, 'tone');
}

/** The `gamut` attribute; `srgb` where there is none. */
export function parseGamut(value: string | null): Gamut {
  return oneOf(value, GAMUTS, 'gamut');
}

/** The `loading` attribute; `auto` where there is none. */
export function parseLoading(value: string | null): Loading {
  return oneOf(value, LOADINGS, 'way of loading');
}

/** The `reveal` attribute; `auto` where there is none. */
export function parseReveal(value: string | null): Reveal {
  return oneOf(value, REVEALS, 'way of revealing');
}

/** The `crossorigin` attribute, as on images: what is neither name is the first. */
export function parseCrossOrigin(value: string | null): 'anonymous' | 'use-credentials' | null {
  if (value === null) return null;
  return value.trim().toLowerCase() === 'use-credentials' ? 'use-credentials' : 'anonymous';
}

/** An attribute that is an address, absolute from then on; `null` where there is none. */
export function parseAddress(value: string | null, name: string, base: string): string | null {
  const address = value?.trim();
  if (!address) return null;
  try {
    return new URL(address, base).href;
  } catch (cause) {
    throw new PhotoError('attribute', `The address “${address}” in ${name} is not a URL.`, cause);
  }
}

/** One of some names, the first where there is none. */
function oneOf<N extends string>(
  value: string | null,
  names: readonly [N, ...(readonly N[])],
  what: string,
): N {
  const name = value?.trim() || names[0];
  const known = names.find((known) => known === name);
  if (known) return known;
  throw new PhotoError(
    'attribute',
    `There is no ${what} named “${name}”. Known names: ${names.join(', ')}.`,
  );
}

/** The nearest point that lies on the picture, as exact as states in addresses are. */
export function clampToPicture({ x, y }: PicturePoint): PicturePoint {
  return { x: clampPlace(x), y: clampPlace(y) };
}

function clampPlace(value: number): number {
  return Math.round(Math.min(1, Math.max(0, value)) * 1e4) / 1e4;
}
