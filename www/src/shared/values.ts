/** Plain value types that settings, events and the public API share. */

/** A position on the picture: (0, 0) is its top left corner and (1, 1) its bottom right corner. */
export interface PicturePoint {
  readonly x: number;
  readonly y: number;
}

export const CENTRE: PicturePoint = { x: 0.5, y: 0.5 };

/** Factors on linear red, green and blue. */
export type RgbFactors = readonly [red: number, green: number, blue: number];

/** The nearest point on the picture. */
export function clampToPicture({ x, y }: PicturePoint): PicturePoint {
  return { x: clampAndRound(x, 0, 1), y: clampAndRound(y, 0, 1) };
}

/** The nearest value in a range, with four decimals: far finer than a pixel, and short in shared states. */
export function clampAndRound(value: number, min: number, max: number): number {
  return Math.round(Math.min(max, Math.max(min, value)) * 1e4) / 1e4;
}
