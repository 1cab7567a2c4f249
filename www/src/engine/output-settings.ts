/** The output transform's settings: how a linear picture becomes codes on the canvas. */

import type { ColorMatrix, RgbGains } from '../shared/value-types.js';
import type { Gamut, OutputTransform, RelightModule, ToneCurve } from './wasm-exports.js';

/** Immutable: a change makes a new object. */
export interface OutputSettings {
  /** Factor on the picture's brightness. */
  readonly exposure: number;
  readonly whiteBalance: RgbGains;
  readonly tone: ToneCurve;
}

/** White balance and exposure are factors on linear sRGB, to which `colorMatrix` converts the photograph. */
export function createOutputTransform(
  { OutputTransform }: Pick<RelightModule, 'OutputTransform'>,
  { exposure, whiteBalance, tone }: OutputSettings,
  colorMatrix: ColorMatrix,
  gamut: Gamut,
): OutputTransform {
  const rows = whiteBalance.flatMap((gain, i) => {
    return (colorMatrix[i] ?? []).map((factor) => exposure * gain * factor);
  });
  return new OutputTransform(Float32Array.from(rows), tone, gamut);
}
