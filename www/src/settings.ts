/** Attribute values, checked. Each parser throws a `PhotoError` that names what it would take. */

import { PhotoError } from './errors.js';
import type { Look } from './look.js';
import { type Backend, type Gamut, LIGHTS, type LightName, type ToneCurve } from './names.js';

export { LIGHTS, type LightName } from './names.js';

/** The back ends, the fastest first: the order in which they are tried. */
export const BACKENDS: readonly Backend[] = ['webgpu', 'webgl2', 'cpu'];

/** A position on the picture: 0, 0 is the top left corner and 1, 1 the bottom right. */
export interface PicturePoint {
  readonly x: number;
  readonly y: number;
}

const DEFAULT_LIGHT: LightName = 'flood';
const DEFAULT_EXPOSURE = 1;
const TONES = ['clip', 'filmic'] as const;
const GAMUTS = ['srgb', 'display-p3'] as const;
/** More than any picture needs, and little enough for the module, which computes in 32-bit floats. */
const MAX_EXPOSURE = 1e30;
const MAX_FACTOR = 1000;

/** The `light` attribute; flood where there is none. */
export function parseLight(value: string | null): LightName {
  const name = value?.trim() || DEFAULT_LIGHT;
  const known = LIGHTS.find((light) => light === name);
  if (known) return known;
  throw new PhotoError(
    'attribute',
    `There is no light named “${name}”. Known lights: ${LIGHTS.join(', ')}.`,
  );
}

/** The `backend` attribute, a list in order of preference; `null` where there is none. */
export function parseBackends(value: string | null): readonly Backend[] | null {
  const names = value?.split(/[\s,]+/).filter(Boolean) ?? [];
  if (names.length === 0) return null;
  const order = new Set<Backend>();
  for (const name of names) {
    const known = BACKENDS.find((backend) => backend === name);
    if (!known) {
      throw new PhotoError(
        'attribute',
        `There is no back end named “${name}”. Known back ends: ${BACKENDS.join(', ')}.`,
      );
    }
    order.add(known);
  }
  return [...order];
}

/** The `exposure` attribute, a factor on the light's brightness; 1 where there is none. */
export function parseExposure(value: string | null): number {
  if (value === null || value.trim() === '') return DEFAULT_EXPOSURE;
  const exposure = Number(value);
  if (exposure >= 0 && exposure <= MAX_EXPOSURE) return exposure;
  throw new PhotoError(
    'attribute',
    `The exposure “${value}” is not a number from 0 to ${MAX_EXPOSURE}; ` +
      '1 shows the photograph as taken.',
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

/** One of some names, the first where there is none. */
function oneOf<N extends string>(
  value: string | null,
  names: readonly [N, ...N[]],
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

/** Where an arrow key takes a torch, or `undefined` for any other key. Shift makes small steps. */
export function stepTorch(
  from: PicturePoint,
  key: string,
  fine: boolean,
): PicturePoint | undefined {
  const step = fine ? 0.01 : 0.05;
  switch (key) {
    case 'ArrowLeft':
      return clampToPicture({ x: from.x - step, y: from.y });
    case 'ArrowRight':
      return clampToPicture({ x: from.x + step, y: from.y });
    case 'ArrowUp':
      return clampToPicture({ x: from.x, y: from.y - step });
    case 'ArrowDown':
      return clampToPicture({ x: from.x, y: from.y + step });
    default:
      return undefined;
  }
}

/** The nearest point that lies on the picture. */
export function clampToPicture({ x, y }: PicturePoint): PicturePoint {
  return { x: Math.min(1, Math.max(0, x)), y: Math.min(1, Math.max(0, y)) };
}
