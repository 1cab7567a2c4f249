/** Encodes and scales the picture on a canvas. */

import type { Gamut } from '../engine/types.js';
import { PhotoError } from '../shared/errors.js';

/** The canvas's picture as a file of the MIME type `type`; `quality` is that of `toBlob`. */
export function encodeCanvas(
  canvas: HTMLCanvasElement,
  type: string,
  quality?: number,
): Promise<Blob> {
  return new Promise((resolve, reject) => {
    const settle = (blob: Blob | null) =>
      blob
        ? resolve(blob)
        : reject(new PhotoError('internal', `The browser could not encode ${type}.`));
    canvas.toBlob(settle, type, quality);
  });
}

/** A copy of a canvas, `scale` times as wide and as high. */
export function resampleCanvas(
  canvas: HTMLCanvasElement,
  scale: number,
  gamut: Gamut,
): HTMLCanvasElement {
  const copy = document.createElement('canvas');
  copy.width = Math.max(1, Math.round(canvas.width * scale));
  copy.height = Math.max(1, Math.round(canvas.height * scale));
  const context = copy.getContext('2d', { colorSpace: gamut });
  if (!context)
    throw new PhotoError('internal', 'The browser has no canvas for scaling the picture.');
  context.imageSmoothingQuality = 'high';
  context.drawImage(canvas, 0, 0, copy.width, copy.height);
  return copy;
}
