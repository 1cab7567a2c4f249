/** The colour of a light: factors on the picture's red, green and blue, like those of the white balance. */

import { PhotoError } from '../shared/errors.js';
import type { RgbGains } from '../shared/value-types.js';

export interface LightColor {
  readonly factors: RgbGains;
  /** The CSS colour in hexadecimal, with `#`. */
  readonly hex: string;
}

/** Parses a CSS colour into red, green, blue and alpha from 0 to 255; `null` if it is invalid. */
export type CssColorParser = (css: string) => readonly number[] | null;

/** The attribute `light-color`; `null`, for white, if it is empty. Alpha scales the brightness. Throws `attribute`. */
export function parseLightColor(value: string | null, parse = parseCssColor): LightColor | null {
  const css = value?.trim();
  if (!css) return null;
  const rgba = parse(css);
  if (!rgba) {
    const message = `The light colour “${css}” is not a CSS colour. Use one such as “orange” or “#ffc080”.`;
    throw new PhotoError('attribute', message);
  }
  const [red = 0, green = 0, blue = 0, alpha = 255] = rgba;
  const opacity = alpha / 255;
  const codes = alpha < 255 ? [red, green, blue, alpha] : [red, green, blue];
  return {
    factors: [opacity * decodeSrgb(red), opacity * decodeSrgb(green), opacity * decodeSrgb(blue)],
    hex: `#${codes.map((code) => code.toString(16).padStart(2, '0')).join('')}`,
  };
}

export function multiplyRgb(a: RgbGains, b: RgbGains): RgbGains {
  return [a[0] * b[0], a[1] * b[1], a[2] * b[2]];
}

/** Linear brightness from 0 to 1 of an sRGB code (IEC 61966-2-1). */
function decodeSrgb(code: number): number {
  const value = code / 255;
  return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
}

let context: CanvasRenderingContext2D | null = null;

/** Parses with a canvas of one pixel, which supports every colour syntax of the browser. */
const parseCssColor: CssColorParser = (css) => {
  context ??= document.createElement('canvas').getContext('2d', { willReadFrequently: true });
  if (!context) return null;
  const canvas = context;
  // An invalid colour leaves the previous fillStyle.
  const fillAfter = (previous: string): unknown => {
    canvas.fillStyle = previous;
    canvas.fillStyle = css;
    return canvas.fillStyle;
  };
  if (fillAfter('#000') !== fillAfter('#fff')) return null;
  canvas.clearRect(0, 0, 1, 1);
  canvas.fillRect(0, 0, 1, 1);
  return [...canvas.getImageData(0, 0, 1, 1).data];
};
