/** Plain value types that settings, events and the public API share. */

/** A position on the picture: (0, 0) is its top left corner and (1, 1) its bottom right corner. */
export interface PicturePoint {
  readonly x: number;
  readonly y: number;
}

export const CENTRE: PicturePoint = { x: 0.5, y: 0.5 };

/** Factors on linear red, green and blue. */
export type RgbFactors = readonly [red: number, green: number, blue: number];

/** The nearest point on the picture, rounded to 4 decimals so that shared states stay short. */
export function clampToPicture({ x, y }: PicturePoint): PicturePoint {
  return { x: clampCoordinate(x), y: clampCoordinate(y) };
}

function clampCoordinate(value: number): number {
  return Math.round(Math.min(1, Math.max(0, value)) * 1e4) / 1e4;
}
