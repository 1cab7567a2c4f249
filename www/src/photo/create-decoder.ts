/** Chooses the thread that decodes: a worker's if the page may have one, otherwise the page's. */

import { loadDecoder } from '../engine/core-modules.js';
import { startWorker } from '../engine/worker-server.js';
import { createMainThreadDecoder } from './main-thread-decoder.js';
import type { PhotoDecoder } from './photo-decoder.js';
import { startWorkerDecoder } from './worker-decoder.js';

export async function createDecoder(): Promise<PhotoDecoder> {
  const worker = startWorker(
    () => new Worker(new URL('./relightable-photo-worker.js', import.meta.url), { type: 'module' }),
  );
  const decoder = worker && (await startWorkerDecoder(worker).catch(() => null));
  // If the module cannot start at all, the page's attempt reports why.
  return decoder ?? createMainThreadDecoder(await loadDecoder(), () => performance.now());
}
