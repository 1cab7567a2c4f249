/**
 * Parsers of the attributes that only the element has. `null` is an absent attribute. Each parser throws a
 * `PhotoError` with the code `attribute` whose message names the accepted values.
 */

import { PhotoError } from '../shared/errors.js';
import { BACKENDS, type Backend, type CrossOrigin } from '../shared/names.js';
import { parseName, parseNumber } from '../shared/parse-settings.js';

const LOADINGS = ['auto', 'lazy', 'eager'] as const;
const REVEALS = ['auto', 'interaction', 'manual'] as const;
/** In units of the light plane's shorter side. A larger torch lights the plane evenly. */
export const MAX_TORCH_SIZE = 100;
/** The WebAssembly modules use this radius when none is given. */
export const DEFAULT_TORCH_SIZE = 1 / 7;
const MAX_ZOOM = 100;
/** The meaning of `zoom` without a value. */
const EMPTY_ZOOM = 8;
/** One day. Browser timers overflow after some weeks. */
const MAX_KIOSK_SECONDS = 86_400;
/** The meaning of `kiosk` without a value. */
const EMPTY_KIOSK_SECONDS = 60;

/** When the photograph is fetched: close to the viewport, in the viewport, or immediately. */
export type Loading = (typeof LOADINGS)[number];
/** When the poster gives way to the picture: when it is drawn, on a press, or by `dismissPoster()`. */
export type Reveal = (typeof REVEALS)[number];

/** Backends in order of preference; `null` leaves the order to the element. */
export function parseBackends(value: string | null): readonly Backend[] | null {
  const names = value?.split(/[\s,]+/).filter(Boolean) ?? [];
  if (names.length === 0) return null;
  return [...new Set(names.map((name) => parseName(name, BACKENDS, 'backend')))];
}

/** The torch's radius in units of the light plane's shorter side; `null` for the default. */
export function parseTorchSize(value: string | null): number | null {
  const hint = 'it is a fraction of the light’s shorter side';
  return parseNumber(value, 'light size', 1e-6, MAX_TORCH_SIZE, hint);
}

/** A coordinate on the picture, for the attribute `name`; `null` for the default. */
export function parseCoordinate(value: string | null, name: string): number | null {
  return parseNumber(value, name, 0, 1, '0 is the picture’s left or upper edge');
}

/** The largest magnification; 1 disables zooming. */
export function parseZoom(value: string | null): number {
  if (value?.trim() === '') return EMPTY_ZOOM;
  return parseNumber(value, 'zoom', 1, MAX_ZOOM, '1 disables zooming') ?? 1;
}

/** Seconds without input before the element resets itself; 0 is never. */
export function parseKiosk(value: string | null): number {
  if (value?.trim() === '') return EMPTY_KIOSK_SECONDS;
  return parseNumber(value, 'kiosk', 0, MAX_KIOSK_SECONDS, 'it is in seconds, 0 is never') ?? 0;
}

export function parseLoading(value: string | null): Loading {
  return parseName(value, LOADINGS, 'loading mode');
}

export function parseReveal(value: string | null): Reveal {
  return parseName(value, REVEALS, 'reveal mode');
}

/** As on `<img>`: any unknown value means `anonymous`. */
export function parseCrossOrigin(value: string | null): CrossOrigin {
  if (value === null) return null;
  return value.trim().toLowerCase() === 'use-credentials' ? 'use-credentials' : 'anonymous';
}

/** An absolute URL, resolved against `base`; `null` for an empty value. */
export function parseAddress(value: string | null, name: string, base: string): string | null {
  const address = value?.trim();
  if (!address) return null;
  try {
    return new URL(address, base).href;
  } catch (cause) {
    throw new PhotoError('attribute', `The address “${address}” in ${name} is not a URL.`, cause);
  }
}
