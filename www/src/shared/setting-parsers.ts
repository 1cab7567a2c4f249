/**
 * Parsers of the settings that the element's attributes and the core's options have in common. `null` or an empty text
 * gives the default. Each throws a `PhotoError` with the code `attribute` whose message names the accepted values.
 */

import { PhotoError } from './errors.js';
import { type Gamut, LIGHTS, type LightName, type ToneCurve } from './keywords.js';
import type { RgbGains } from './value-types.js';

const TONES = ['clip', 'filmic'] as const;
const GAMUTS = ['srgb', 'display-p3'] as const;
/** Leaves room below the largest 32-bit float, with which the WebAssembly modules compute. */
export const MAX_EXPOSURE = 1e30;
const MAX_WHITE_BALANCE = 1000;

type AttributeParser<T> = (value: string | null) => T;

export const parseLight: AttributeParser<LightName> = (value) => parseName(value, LIGHTS, 'light');
export const parseTone: AttributeParser<ToneCurve> = (value) => parseName(value, TONES, 'tone');
export const parseGamut: AttributeParser<Gamut> = (value) => parseName(value, GAMUTS, 'gamut');

export function parseExposure(value: string | null): number {
  const hint = '1 shows the photograph as taken';
  return parseNumber(value, 'exposure', 0, MAX_EXPOSURE, hint) ?? 1;
}

export function parseWhiteBalance(value: string | null): RgbGains {
  if (!value?.trim()) return [1, 1, 1];
  const factors = value
    .trim()
    .split(/[\s,]+/)
    .map(Number);
  const inRange = (factor: number) => factor >= 0 && factor <= MAX_WHITE_BALANCE;
  if (factors.length === 3 && factors.every(inRange)) return factors as unknown as RgbGains;
  const message =
    `The white balance “${value}” is not three numbers from 0 to ${MAX_WHITE_BALANCE}, for red, ` +
    'green and blue; “1 1 1” shows the photograph as taken.';
  throw new PhotoError('attribute', message);
}

/** A number from `min` to `max`; `null` for an empty value. `hint` ends the error message. */
export function parseNumber(
  value: string | null,
  label: string,
  min: number,
  max: number,
  hint: string,
): number | null {
  if (!value?.trim()) return null;
  const number = Number(value);
  if (number >= min && number <= max) return number;
  const message = `The ${label} “${value}” is not a number from ${min} to ${max}; ${hint}.`;
  throw new PhotoError('attribute', message);
}

/** One of `names`; the first is the default. */
export function parseName<N extends string>(
  value: string | null,
  names: readonly [N, ...(readonly N[])],
  label: string,
): N {
  const name = value?.trim() || names[0];
  const known = names.find((known) => known === name);
  if (known) return known;
  const message = `There is no ${label} named “${name}”. Known names: ${names.join(', ')}.`;
  throw new PhotoError('attribute', message);
}
