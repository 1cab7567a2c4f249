/** The colour of a light. Transport goes by channel, so a light that is tinted is a picture that is. */

import type { Look } from '../engine/output-settings.js';
import { PhotoError } from '../shared/errors.js';

/** Factors on linear red, green and blue. */
export type Tint = Look['whiteBalance'];

/** A light of any colour, as its page has it. */
export interface LightColor {
  readonly tint: Tint;
  /** The same in hexadecimal digits, behind #. */
  readonly hex: string;
}

/** Reads a colour as the browser does: its red, green, blue and alpha of 255; `null` where it is none. */
export type ReadColor = (css: string) => readonly number[] | null;

/** The `light-color` attribute; `null`, which is white, where there is none. What is transparent by half shines by half. */
export function parseColor(value: string | null, read: ReadColor): LightColor | null {
  const css = value?.trim();
  if (!css) return null;
  const seen = read(css);
  if (!seen) {
    const message = `The light color “${css}” is no CSS colour; “white” tints nothing.`;
    throw new PhotoError('attribute', message);
  }
  const [red = 0, green = 0, blue = 0, alpha = 255] = seen;
  const share = alpha / 255;
  const codes = alpha < 255 ? [red, green, blue, alpha] : [red, green, blue];
  return {
    tint: [share * linear(red), share * linear(green), share * linear(blue)],
    hex: `#${codes.map((code) => code.toString(16).padStart(2, '0')).join('')}`,
  };
}

/** Both of them. */
export function tinted(balance: Tint, tint: Tint): Tint {
  return [balance[0] * tint[0], balance[1] * tint[1], balance[2] * tint[2]];
}

/** What a code of sRGB stands for, from 0 to 1 (IEC 61966-2-1). */
function linear(code: number): number {
  const value = code / 255;
  return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
}

let canvas: CanvasRenderingContext2D | null = null;
const known = new Map<string, readonly number[] | null>();

/** By a canvas of one pixel, which knows every colour that the browser does. */
export const browserColor: ReadColor = (css) => {
  const before = known.get(css);
  if (before !== undefined) return before;
  canvas ??= document.createElement('canvas').getContext('2d', { willReadFrequently: true });
  if (!canvas) return null;
  // What is no colour leaves the last one.
  const over = (last: string): unknown => {
    (canvas as CanvasRenderingContext2D).fillStyle = last;
    (canvas as CanvasRenderingContext2D).fillStyle = css;
    return canvas?.fillStyle;
  };
  let codes: readonly number[] | null = null;
  if (over('#000') === over('#fff')) {
    canvas.clearRect(0, 0, 1, 1);
    canvas.fillRect(0, 0, 1, 1);
    codes = [...canvas.getImageData(0, 0, 1, 1).data];
  }
  known.set(css, codes);
  return codes;
};
