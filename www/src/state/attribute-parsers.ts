/** Parsers of all attributes that are not plain text; `null` is an absent one. As in `setting-parsers`, they throw. */

import { PhotoError } from '../shared/errors.js';
import { BACKENDS, type Backend, type CrossOrigin } from '../shared/keywords.js';
import {
  parseExposure,
  parseGamut,
  parseLight,
  parseName,
  parseNumber,
  parseTone,
  parseWhiteBalance,
} from '../shared/setting-parsers.js';

const LOADINGS = ['eager', 'lazy'] as const;
const REVEALS = ['auto', 'interaction', 'manual'] as const;
/** In units of the light plane's shorter side. A larger torch lights the plane evenly. */
export const MAX_TORCH_SIZE = 100;
const LIGHT_SIZE_HINT = 'it is a fraction of the light’s shorter side';
/** The WebAssembly modules use this radius when none is given. */
export const DEFAULT_TORCH_SIZE = 1 / 7;
/** Of the attribute, and of views until the size of the picture is known. */
export const MAX_ZOOM = 100;
/** The meaning of `zoom` without a value, but for very large pictures. */
export const EMPTY_ZOOM = 8;
const MAX_SIZE_PIXELS = 1e6;
/** One day. Browser timers overflow after some weeks. */
const MAX_KIOSK_SECONDS = 86_400;
/** The meaning of `kiosk` without a value. */
const EMPTY_KIOSK_SECONDS = 60;

/** When the photograph is fetched, as on `<img>`: at once, or close to the viewport. */
export type LoadingMode = (typeof LOADINGS)[number];
/** When the poster gives way to the picture: when it is drawn, on a press, or by `dismissPoster()`. */
export type RevealMode = (typeof REVEALS)[number];

type AttributeText = string | null;

/** By attribute. Absent coordinates, sizes, backends and addresses are `null`. */
export const PARSERS = {
  light: parseLight,
  exposure: parseExposure,
  'white-balance': parseWhiteBalance,
  tone: parseTone,
  gamut: parseGamut,
  /** The torch's radius in units of the light plane's shorter side. */
  'light-size': (text: AttributeText) =>
    parseNumber(text, 'light size', 1e-6, MAX_TORCH_SIZE, LIGHT_SIZE_HINT),
  'light-x': (text: AttributeText) => parseCoordinate(text, 'light-x'),
  'light-y': (text: AttributeText) => parseCoordinate(text, 'light-y'),
  width: (text: AttributeText) => parseSize(text, 'width'),
  height: (text: AttributeText) => parseSize(text, 'height'),
  /** In order of preference. */
  backend: (text: AttributeText): readonly Backend[] | null => {
    const names = text?.split(/[\s,]+/).filter(Boolean) ?? [];
    if (names.length === 0) return null;
    return [...new Set(names.map((name) => parseName(name, BACKENDS, 'backend')))];
  },
  /** The largest magnification; 1 disables zooming, and `null` leaves it to the picture. */
  zoom: (text: AttributeText) =>
    text?.trim() === ''
      ? null
      : (parseNumber(text, 'zoom', 1, MAX_ZOOM, '1 disables zooming') ?? 1),
  /** Seconds without input before the element resets itself; 0 is never. */
  kiosk: (text: AttributeText) =>
    text?.trim() === ''
      ? EMPTY_KIOSK_SECONDS
      : (parseNumber(text, 'kiosk', 0, MAX_KIOSK_SECONDS, 'it is in seconds, 0 is never') ?? 0),
  loading: (text: AttributeText) => parseName(text, LOADINGS, 'loading mode'),
  reveal: (text: AttributeText) => parseName(text, REVEALS, 'reveal mode'),
  /** As on `<img>`: any unknown value means `anonymous`. */
  crossorigin: (text: AttributeText): CrossOrigin => {
    if (text === null) return null;
    return text.trim().toLowerCase() === 'use-credentials' ? 'use-credentials' : 'anonymous';
  },
} as const;

export type ParsedValue<K extends keyof typeof PARSERS> = ReturnType<(typeof PARSERS)[K]>;

export function parserOf<K extends keyof typeof PARSERS>(name: K) {
  return PARSERS[name] as (text: AttributeText) => ParsedValue<K>;
}

function parseCoordinate(text: AttributeText, name: string): number | null {
  return parseNumber(text, name, 0, 1, '0 is the picture’s left or upper edge');
}

function parseSize(text: AttributeText, name: string): number | null {
  return parseNumber(text, name, 1, MAX_SIZE_PIXELS, 'it is in CSS pixels');
}

/** An absolute URL, resolved against `base`; `null` for an empty value. */
export function parseAddress(text: AttributeText, name: string, base: string): string | null {
  const address = text?.trim();
  if (!address) return null;
  try {
    return new URL(address, base).href;
  } catch (cause) {
    throw new PhotoError('attribute', `The address “${address}” in ${name} is not a URL.`, cause);
  }
}
