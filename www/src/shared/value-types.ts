/** Plain value types that many modules share. Free of DOM types, because the core's types depend on it. */

/** A range of a file's bytes, without the byte at `end`. */
export interface ByteRange {
  readonly start: number;
  readonly end: number;
}

/** A part of a picture, in pixels; without the column `right` and the row `bottom`. */
export interface PixelRect {
  readonly left: number;
  readonly top: number;
  readonly right: number;
  readonly bottom: number;
}

/** What the file's index says about a photograph. */
export interface PhotoInfo {
  /** The picture's width in pixels. */
  readonly width: number;
  /** The picture's height in pixels. */
  readonly height: number;
  /** The light plane's width in light elements. */
  readonly lightWidth: number;
  /** The light plane's height in light elements. */
  readonly lightHeight: number;
  /** Memory that the decoded light transport matrix takes, in bytes. */
  readonly decodedBytes: number;
  /** The file's metadata, a JSON object. */
  readonly metadata: unknown;
}

/** A position on the picture: (0, 0) is its top left corner and (1, 1) its bottom right corner. */
export interface PicturePoint {
  readonly x: number;
  readonly y: number;
}

export const CENTRE: PicturePoint = { x: 0.5, y: 0.5 };

export type RgbGains = readonly [red: number, green: number, blue: number];

/** From linear RGB of a photograph to linear sRGB, row by row. */
export type ColorMatrix = readonly [RgbGains, RgbGains, RgbGains];

export function clampToPicture({ x, y }: PicturePoint): PicturePoint {
  return { x: clampAndRound(x, 0, 1), y: clampAndRound(y, 0, 1) };
}

/** The nearest value in a range, with four decimals: far finer than most pixels, and short in share links. */
export function clampAndRound(value: number, min: number, max: number, steps = 1e4): number {
  return Math.round(Math.min(max, Math.max(min, value)) * steps) / steps;
}
