/** Reads the pixels of an image that is used as light. */

import { messageOf, PhotoError } from '../shared/errors.js';
import type { ImageLight } from './light-setting.js';
import {
  type BrowserImageSource,
  isInstance,
  isLinearLight,
  isLivePicture,
  type LightImageSource,
} from './light-source.js';

type Size = Pick<ImageData, 'width' | 'height'>;

/** The browser scales larger images down, for speed. It averages sRGB codes; at this size the error hardly shows. */
const MAX_PIXELS = 1 << 22;

let sharedContext: CanvasRenderingContext2D | null = null;

/** An image light that reads `image` at each frame. */
export function toImageLight(image: LightImageSource): ImageLight {
  return {
    uploadable() {
      const size = isLivePicture(image) ? imageSize(image) : null;
      if (!isLivePicture(image) || !size?.width || !size.height) return null;
      return { image, width: size.width, height: size.height };
    },
    createLight({ Light }, photo) {
      if (isLinearLight(image)) {
        return Light.fromLinear(photo, image.data, image.width, image.height);
      }
      const pixels = readPixels(image);
      return pixels && Light.fromSrgb(photo, pixels.data, pixels.width, pixels.height);
    },
  };
}

/** The current sRGB pixels; `null` while nothing is loaded. Throws `light-tainted`, `light-size` or `light-source`. */
function readPixels(image: BrowserImageSource): ImageData | null {
  const size = imageSize(image);
  if (!size) return null;
  const { width, height } = size;
  if (width === 0 || height === 0) {
    const message = `The light image has ${width} × ${height} pixels. It needs at least one.`;
    throw new PhotoError('light-size', message);
  }
  if (isInstance('ImageData', image)) {
    const isSrgb = (image.colorSpace ?? 'srgb') === 'srgb';
    if (isSrgb && image.data instanceof Uint8ClampedArray) return image;
  }
  try {
    return drawPixels(image, size);
  } catch (cause) {
    // A canvas that has shown another origin's image stays unreadable.
    sharedContext = null;
    if (cause instanceof PhotoError) throw cause;
    if (cause instanceof DOMException && cause.name === 'SecurityError') throw taintedError(cause);
    const message = `The light image cannot be read any more. The browser says: ${messageOf(cause)}`;
    throw new PhotoError('light-source', message, cause);
  }
}

/** `null` while nothing is loaded. */
function imageSize(image: BrowserImageSource): Size | null {
  if (isInstance('HTMLImageElement', image)) {
    const { complete, naturalWidth: width, naturalHeight: height } = image;
    return complete && width > 0 && height > 0 ? { width, height } : null;
  }
  if (isInstance('HTMLVideoElement', image)) {
    const { readyState, videoWidth: width, videoHeight: height } = image;
    // 2 is HAVE_CURRENT_DATA. A video with sound only has no size.
    return readyState >= 2 && width > 0 ? { width, height } : null;
  }
  return image;
}

function drawPixels(image: BrowserImageSource, { width, height }: Size): ImageData {
  if (isInstance('ImageData', image)) {
    const context = emptyContext(width, height);
    context.putImageData(image, 0, 0);
    return context.getImageData(0, 0, width, height);
  }
  const scale = Math.min(1, Math.sqrt(MAX_PIXELS / (width * height)));
  const scaledWidth = Math.max(1, Math.floor(width * scale));
  const scaledHeight = Math.max(1, Math.floor(height * scale));
  const context = emptyContext(scaledWidth, scaledHeight);
  context.imageSmoothingQuality = 'high';
  context.drawImage(image, 0, 0, scaledWidth, scaledHeight);
  return context.getImageData(0, 0, scaledWidth, scaledHeight);
}

/** The page's shared canvas, cleared and resized. */
function emptyContext(width: number, height: number): CanvasRenderingContext2D {
  // willReadFrequently keeps the canvas out of graphics memory, which is slow to read.
  sharedContext ??= document.createElement('canvas').getContext('2d', { willReadFrequently: true });
  if (!sharedContext) {
    const message = 'The light image cannot be read: the browser has no memory for a canvas.';
    throw new PhotoError('light-source', message);
  }
  const { canvas } = sharedContext;
  if (canvas.width === width && canvas.height === height) {
    sharedContext.clearRect(0, 0, width, height);
  } else {
    canvas.width = width;
    canvas.height = height;
  }
  return sharedContext;
}

function taintedError(cause: unknown): PhotoError {
  const message =
    'The light image comes from another origin, and this page may not read it. Load it with ' +
    'crossorigin="anonymous" from a server that sends Access-Control-Allow-Origin.';
  return new PhotoError('light-tainted', message, cause);
}
