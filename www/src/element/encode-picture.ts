/** Encodes the picture on a renderer's canvas as a file. */

import type { Renderer } from '../renderers/types.js';
import { PhotoError } from '../shared/errors.js';

type DrawnCanvas = Pick<Renderer, 'canvas' | 'gamut'>;

/** Maximum side of a picture of several levels, in pixels: what all browsers have canvases for. */
const MAX_SNAPSHOT_SIDE = 4096;

/**
 * Reads the canvas at once: that of a GPU keeps its content only until the next frame. `quality` is that of
 * `HTMLCanvasElement.toBlob`.
 */
export function encodePicture(
  renderer: DrawnCanvas & Pick<Renderer, 'snapshot'>,
  type: string,
  quality: number | undefined,
  scale: number,
): Promise<Blob> {
  return new Promise((resolve, reject) => {
    const settle = (blob: Blob | null) =>
      blob
        ? resolve(blob)
        : reject(new PhotoError('internal', `The browser could not encode ${type}.`));
    const whole = renderer.snapshot?.(MAX_SNAPSHOT_SIDE) ?? renderer.canvas;
    const { gamut } = renderer;
    const canvas = scale === 1 ? whole : resample({ canvas: whole, gamut }, scale);
    canvas.toBlob(settle, type, quality);
  });
}

function resample({ canvas, gamut }: DrawnCanvas, scale: number): HTMLCanvasElement {
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
