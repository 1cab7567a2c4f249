/** What all canvases with a photograph on them have in common. */

import { PhotoError } from './errors.js';
import type { Drawing } from './player.js';

/** A drawing that is a canvas. */
export interface CanvasSurface extends Drawing {
  readonly canvas: HTMLCanvasElement;
  /** The picture as it was drawn last, in the turn of the event loop that drew it. */
  toBlob(type: string, quality?: number): Promise<Blob>;
}

/** What a canvas shows, encoded. */
export function blobOf(canvas: HTMLCanvasElement, type: string, quality?: number): Promise<Blob> {
  return new Promise((resolve, reject) => {
    const done = (blob: Blob | null) =>
      blob
        ? resolve(blob)
        : reject(new PhotoError('internal', `The browser could not encode ${type}.`));
    canvas.toBlob(done, type, quality);
  });
}
