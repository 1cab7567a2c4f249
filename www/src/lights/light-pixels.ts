/** The pixels of pictures that the browser has. */

import { PhotoError } from '../shared/errors.js';
import { type BrowserPicture, isA } from './light-source.js';

/** Of a picture, in pixels. */
export interface Size {
  readonly width: number;
  readonly height: number;
}

/**
 * Pixels beyond which the browser scales a picture down before it is read. It mixes codes where light
 * should be mixed, which is why nothing else is left to it; but a large photograph would take a second
 * to read, and has so many pixels for each element of a light that it hardly shows.
 */
const MOST_PIXELS = 1 << 22;

let scratch: CanvasRenderingContext2D | null = null;

/**
 * What a picture shows now, in sRGB, colours apart from alpha; `null` while there is nothing to be seen of
 * it. Throws `light-tainted`, `light-size` or `light-source`.
 */
export function pixelsOf(picture: BrowserPicture): ImageData | null {
  const size = sizeOf(picture);
  if (!size) return null;
  if (size.width === 0 || size.height === 0) {
    const { width, height } = size;
    const message = `The picture that is the light has ${width} × ${height} pixels; it needs some.`;
    throw new PhotoError('light-size', message);
  }
  if (isA('ImageData', picture)) {
    const srgb = (picture.colorSpace ?? 'srgb') === 'srgb';
    if (srgb && picture.data instanceof Uint8ClampedArray) return picture;
  }
  return read(picture, size);
}

/** `null` while nothing has come. */
export function sizeOf(picture: BrowserPicture): Size | null {
  if (isA('HTMLImageElement', picture)) {
    const { complete, naturalWidth: width, naturalHeight: height } = picture;
    return complete && width > 0 && height > 0 ? { width, height } : null;
  }
  if (isA('HTMLVideoElement', picture)) {
    const { readyState, videoWidth: width, videoHeight: height } = picture;
    // HAVE_CURRENT_DATA; what has sound alone has no size.
    return readyState >= 2 && width > 0 ? { width, height } : null;
  }
  return picture;
}

function read(picture: BrowserPicture, { width, height }: Size): ImageData {
  try {
    if (isA('ImageData', picture)) {
      const context = scratchOf(width, height);
      context.putImageData(picture, 0, 0);
      return context.getImageData(0, 0, width, height);
    }
    const scale = Math.min(1, Math.sqrt(MOST_PIXELS / (width * height)));
    const across = Math.max(1, Math.floor(width * scale));
    const down = Math.max(1, Math.floor(height * scale));
    const context = scratchOf(across, down);
    context.imageSmoothingQuality = 'high';
    context.drawImage(picture, 0, 0, across, down);
    return context.getImageData(0, 0, across, down);
  } catch (cause) {
    // What has once seen another origin's picture is never let read again.
    scratch = null;
    if (cause instanceof PhotoError) throw cause;
    if (cause instanceof DOMException && cause.name === 'SecurityError') throw tainted(cause);
    const said = cause instanceof Error ? cause.message : String(cause);
    const message = `The picture that is the light cannot be read any more. The browser says: ${said}`;
    throw new PhotoError('light-source', message, cause);
  }
}

/** The page's one canvas for this, empty, of that size. */
function scratchOf(width: number, height: number): CanvasRenderingContext2D {
  // Kept out of the graphics memory, from which reading is slow.
  scratch ??= document.createElement('canvas').getContext('2d', { willReadFrequently: true });
  if (!scratch)
    throw new PhotoError('light-source', 'The browser gives no canvas to read light by.');
  const { canvas } = scratch;
  if (canvas.width === width && canvas.height === height) {
    scratch.clearRect(0, 0, width, height);
  } else {
    canvas.width = width;
    canvas.height = height;
  }
  return scratch;
}

function tainted(cause: unknown): PhotoError {
  return new PhotoError(
    'light-tainted',
    'The picture that is the light shows something of another origin, which this page may not read. ' +
      'Load that with crossorigin="anonymous", from a server that sends Access-Control-Allow-Origin.',
    cause,
  );
}
