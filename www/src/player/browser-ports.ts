/** The browser's implementation of the session's ports, for all elements of the page. */

import { forbiddenByPolicy } from '../loading/http-errors.js';
import { openPhoto } from '../loading/load.js';
import { createDecoder } from '../photo/create-decoder.js';
import { PhotoLibrary } from '../photo/photo-library.js';
import { LoadedPhotograph } from '../photo/photograph.js';
import { createRenderer, prepare } from '../renderers/renderer-factory.js';
import { withPolicyErrors } from '../shared/content-security-policy.js';
import { missingScript } from '../shared/errors.js';
import { callLater } from '../shared/promises.js';
import type { SessionPorts } from './types.js';

const library = new PhotoLibrary(async ({ src, credentials }, options) => {
  if (typeof src !== 'string') {
    const { descriptor, tiles } = await src.load(options);
    return new LoadedPhotograph(descriptor, tiles);
  }
  return openPhoto(src, options, {
    createDecoder,
    fetch: (input, init) =>
      withPolicyErrors(
        () => fetch(input, { ...init, credentials }),
        /^connect-src/,
        (directive, cause) => forbiddenByPolicy(src, directive, cause),
      ),
    yieldToPage,
    now: () => performance.now(),
  });
});

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

function yieldToPage(): Promise<void> {
  const { scheduler } = globalThis as { scheduler?: { yield?: () => Promise<void> } };
  return scheduler?.yield?.() ?? new Promise((resolve) => setTimeout(resolve));
}

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
