/** How a picture is shown. */

import type { Display, DrawingModule, Gamut, ToneCurve } from './types.js';

/** What a picture's brightness and colour are multiplied by, and how they are rendered. */
export interface Look {
  /** Factor on the picture's brightness. */
  readonly exposure: number;
  /** Factors on red, green and blue. */
  readonly whiteBalance: readonly [red: number, green: number, blue: number];
  readonly tone: ToneCurve;
}

/** That look in the module, for a canvas of a gamut. */
export function makeDisplay(
  { Display }: Pick<DrawingModule, 'Display'>,
  { exposure, whiteBalance, tone }: Look,
  gamut: Gamut,
): Display {
  return new Display(exposure, Float64Array.from(whiteBalance), tone, gamut);
}
