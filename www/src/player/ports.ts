/** What a player needs done, by the browser. */

import { forbidden } from '../loading/http-errors.js';
import { openPhoto } from '../loading/load.js';
import { newDecoder } from '../photo/decoders.js';
import { draw, prepare } from '../renderers/renderer-factory.js';
import type { CanvasRenderer } from '../renderers/types.js';
import { allowed } from '../shared/policy.js';
import type { SessionPorts } from './photo-session.js';

/** For all elements of the page. */
export const BROWSER_PORTS: SessionPorts<CanvasRenderer> = {
  open: (src, credentials, signal, onProgress, onPreview) =>
    openPhoto(src, signal, onProgress, onPreview, {
      decoder: newDecoder,
      fetch: (input, init) =>
        allowed(
          () => fetch(input, { ...init, credentials }),
          /^connect-src/,
          (directive, cause) => forbidden(src, directive, cause),
        ),
      pause,
      now: () => performance.now(),
    }),
  draw,
  prepare: (renderOptions, over) => void prepare(renderOptions, over),
  nextFrame: (callback) => requestAnimationFrame(callback),
  later: (ms, callback) => {
    const timer = setTimeout(callback, ms);
    return () => clearTimeout(timer);
  },
  now: () => performance.now(),
};

/** Gives the page its turn. */
function pause(): Promise<void> {
  const { scheduler } = globalThis as { scheduler?: { yield?: () => Promise<void> } };
  return scheduler?.yield?.() ?? new Promise((resolve) => setTimeout(resolve));
}
