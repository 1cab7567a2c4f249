/** What a page may light a photograph with, besides the built-in lights. */

/** A picture of light by its numbers, of any size. */
export interface LinearLight {
  /** Linear red, green and blue, 0 dark and 1 full brightness, row by row. */
  readonly data: Float32Array;
  readonly width: number;
  readonly height: number;
}

/** A picture that may change at any time, or was made to be drawn, and is as large as it says. */
export type LivePicture = HTMLCanvasElement | OffscreenCanvas | ImageBitmap | HTMLVideoElement;

/** A picture that the browser has; codes stand for light as sRGB has it. */
export type BrowserPicture = HTMLImageElement | ImageData | LivePicture;

/** What can be looked at at any time. */
export type LightPicture = BrowserPicture | LinearLight;

/**
 * What shines on a photograph: its upper left is the light's. Transparent parts are dark. Of a video or
 * a stream every frame is taken up; canvases and numbers are read again by `lightChanged()`.
 */
export type LightSource = LightPicture | MediaStream;

interface Classes {
  HTMLImageElement: HTMLImageElement;
  HTMLCanvasElement: HTMLCanvasElement;
  OffscreenCanvas: OffscreenCanvas;
  ImageBitmap: ImageBitmap;
  ImageData: ImageData;
  HTMLVideoElement: HTMLVideoElement;
  MediaStream: MediaStream;
}

const CLASSES: readonly (keyof Classes)[] = [
  'HTMLImageElement',
  'HTMLCanvasElement',
  'OffscreenCanvas',
  'ImageBitmap',
  'ImageData',
  'HTMLVideoElement',
  'MediaStream',
];

/** Whether something is of one of the browser's classes; not every browser has them all. */
export function isA<K extends keyof Classes>(name: K, value: unknown): value is Classes[K] {
  const type = (globalThis as Record<string, unknown>)[name];
  return typeof type === 'function' && value instanceof type;
}

const LIVE: readonly (keyof Classes)[] = [
  'HTMLCanvasElement',
  'OffscreenCanvas',
  'ImageBitmap',
  'HTMLVideoElement',
];

/** Whether a picture may change at any time, or was made to be drawn. */
export function isLive(picture: LightPicture): picture is LivePicture {
  return LIVE.some((name) => isA(name, picture));
}

/** Whether it is light by its numbers; whether they fit each other is found out later. */
export function isLinear(value: unknown): value is LinearLight {
  if (typeof value !== 'object' || value === null) return false;
  const { data, width, height } = value as Partial<LinearLight>;
  return data instanceof Float32Array && typeof width === 'number' && typeof height === 'number';
}

/** Whether something can light a photograph. */
export function isLightSource(value: unknown): value is LightSource {
  return isLinear(value) || CLASSES.some((name) => isA(name, value));
}

/** Throws a `TypeError` for anything that cannot light a photograph. */
export function checkLightSource(value: unknown): LightSource {
  if (isLightSource(value)) return value;
  throw new TypeError(
    'lightSource must be null, an image, canvas or video element, an OffscreenCanvas, ImageBitmap, ' +
      'ImageData or MediaStream, or linear light as { data: Float32Array, width, height }',
  );
}
