/** The light sources that a page may use in place of the built-in lights. */

import type { ExternalImageSource } from '../engine/wasm-exports.js';

/** A light image of any size in linear values. */
export interface LinearImage {
  /** Linear red, green and blue, row by row: 0 is dark, 1 is full brightness. */
  readonly data: Float32Array;
  readonly width: number;
  readonly height: number;
}

/** A picture in one of the browser's classes, in sRGB. */
export type BrowserImageSource = HTMLImageElement | ImageData | ExternalImageSource;

/** A picture whose pixels can be read at any time. */
export type LightImageSource = BrowserImageSource | LinearImage;

/**
 * Lights the photograph: the source's upper left corner is that of the light plane. Transparent pixels are dark.
 * The element follows every frame of a video or stream; it reads canvases and numbers again on `lightChanged()`.
 */
export type LightSource = LightImageSource | MediaStream;

const LIVE_CLASSES = [
  'HTMLCanvasElement',
  'OffscreenCanvas',
  'ImageBitmap',
  'HTMLVideoElement',
] as const;
const CLASSES = [...LIVE_CLASSES, 'HTMLImageElement', 'ImageData', 'MediaStream'] as const;

/** Whether `value` is an instance of a browser class. Some browsers lack some of the classes. */
export function isInstance<K extends (typeof CLASSES)[number]>(
  name: K,
  value: unknown,
): value is InstanceType<(typeof globalThis)[K]> {
  const type = (globalThis as Record<string, unknown>)[name];
  return typeof type === 'function' && value instanceof type;
}

export function isLivePicture(picture: LightImageSource): picture is ExternalImageSource {
  return LIVE_CLASSES.some((name) => isInstance(name, picture));
}

/** Checks the types only; the WebAssembly module checks that the size fits the data. */
export function isLinearLight(value: unknown): value is LinearImage {
  if (typeof value !== 'object' || value === null) return false;
  const { data, width, height } = value as Partial<LinearImage>;
  return data instanceof Float32Array && typeof width === 'number' && typeof height === 'number';
}

export function isLightSource(value: unknown): value is LightSource {
  return isLinearLight(value) || CLASSES.some((name) => isInstance(name, value));
}

/** @throws {TypeError} if `value` is not a light source */
export function checkLightSource(value: unknown): LightSource {
  if (isLightSource(value)) return value;
  throw new TypeError(
    'light must be null, the name of a built-in light, { name, x, y, size, color }, an image, canvas, video, ' +
      'OffscreenCanvas, ImageBitmap, ImageData or MediaStream, or { data: Float32Array, width, height }',
  );
}
