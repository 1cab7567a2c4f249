/** Encoding and scaling the picture on a canvas. */

import type { Gamut } from '../engine/types.js';
import { PhotoError } from '../shared/errors.js';

/** What a canvas shows, encoded. */
export function encodeCanvas(
  canvas: HTMLCanvasElement,
  type: string,
  quality?: number,
): Promise<Blob> {
  return new Promise((resolve, reject) => {
    const done = (blob: Blob | null) =>
      blob
        ? resolve(blob)
        : reject(new PhotoError('internal', `The browser could not encode ${type}.`));
    canvas.toBlob(done, type, quality);
  });
}

/** A canvas as it looks now, of so many times the pixels along either side. */
export function resampleCanvas(
  canvas: HTMLCanvasElement,
  scale: number,
  gamut: Gamut,
): HTMLCanvasElement {
  const copy = document.createElement('canvas');
  copy.width = Math.max(1, Math.round(canvas.width * scale));
  copy.height = Math.max(1, Math.round(canvas.height * scale));
  const context = copy.getContext('2d', { colorSpace: gamut });
  if (!context) throw new PhotoError('internal', 'The browser gives no canvas to scale by.');
  context.imageSmoothingQuality = 'high';
  context.drawImage(canvas, 0, 0, copy.width, copy.height);
  return copy;
}
