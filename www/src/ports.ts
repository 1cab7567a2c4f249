/** What a player needs done, by the browser. */

import type { CanvasSurface } from './canvas.js';
import { newDecoder } from './decoders.js';
import { draw, prepare } from './drawings.js';
import { forbidden } from './http-errors.js';
import { openPhoto } from './load.js';
import type { Ports } from './player.js';
import { allowed } from './policy.js';

/** For all elements of the page. */
export const PORTS: Ports<CanvasSurface> = {
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
  prepare: (wanted, over) => void prepare(wanted, over),
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
