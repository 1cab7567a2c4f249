/** The output transform's settings: how a linear picture becomes codes on the canvas. */

import type { RgbGains } from '../shared/value-types.js';
import type { Gamut, OutputTransform, RelightModule, ToneCurve } from './wasm-exports.js';

/** Immutable: a change makes a new object. */
export interface OutputSettings {
  /** Factor on the picture's brightness. */
  readonly exposure: number;
  readonly whiteBalance: RgbGains;
  readonly tone: ToneCurve;
}

export function createOutputTransform(
  { OutputTransform }: Pick<RelightModule, 'OutputTransform'>,
  { exposure, whiteBalance, tone }: OutputSettings,
  gamut: Gamut,
): OutputTransform {
  return new OutputTransform(exposure, Float64Array.from(whiteBalance), tone, gamut);
}
