/** The browser's implementation of the session's ports, for all elements of the page. */

import { loadPhoto } from '../loading/load-photo.js';
import { PhotoLibrary } from '../photo/photo-library.js';
import { createRenderer, prepare } from '../renderers/renderer-factory.js';
import { missingScript } from '../shared/errors.js';
import { callLater } from '../shared/promises.js';
import type { SessionPorts } from './types.js';

const library = new PhotoLibrary(loadPhoto);

export const BROWSER_PORTS: SessionPorts = {
  library,
  async createRenderer(backend, photograph, options, onLost, signal) {
    const root = await createRenderer(backend, photograph, options, onLost, signal);
    if (photograph.descriptor.levels.length === 0 || !photograph.isComplete) return root;
    const levels = await import('../levels/leveled-renderer.js').catch((cause: unknown) => {
      console.warn(missingScript('levels-unavailable', 'finer levels', cause).message);
    });
    if (!levels) return root;
    return new levels.LeveledRenderer(root, photograph, (shard, onLost, signal) =>
      createRenderer(backend, shard, options, onLost, signal),
    );
  },
  prepare: (options, signal) => void prepare(options, signal),
  copyCanvas,
  nextFrame: (callback) => requestAnimationFrame(callback),
  callLater,
  now: () => performance.now(),
};

function copyCanvas({
  canvas,
  gamut,
}: Parameters<SessionPorts['copyCanvas']>[0]): HTMLCanvasElement {
  const copy = document.createElement('canvas');
  copy.width = canvas.width;
  copy.height = canvas.height;
  copy.getContext('2d', { colorSpace: gamut })?.drawImage(canvas, 0, 0);
  return copy;
}
