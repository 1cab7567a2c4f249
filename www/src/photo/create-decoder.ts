/** Chooses the thread that decodes: a worker's if the page may have one, otherwise the page's. */

import { loadDecoder } from '../engine/core-modules.js';
import { startWorker } from '../engine/worker-server.js';
import { missingScript } from '../shared/errors.js';
import type { PhotoDecoder } from './photo-decoder.js';
import { DecodeWorkers } from './worker-decoder.js';

const workers = new DecodeWorkers(() =>
  startWorker(
    () => new Worker(new URL('./relightable-photo-worker.js', import.meta.url), { type: 'module' }),
  ),
);

/** With `maxTileBytes`, the photograph has the first components only, as far as their tiles take no more memory. */
export async function createDecoder(maxTileBytes?: number): Promise<PhotoDecoder> {
  const decoder = await workers.createDecoder(maxTileBytes).catch(() => null);
  if (decoder) return decoder;
  // If the module cannot start at all, the page's attempt reports why.
  const [module, { createMainThreadDecoder }] = await Promise.all([
    loadDecoder(),
    import('./main-thread-decoder.js').catch((cause: unknown) => {
      throw missingScript('worker-unavailable', 'decoding without a worker', cause);
    }),
  ]);
  return createMainThreadDecoder(module, () => performance.now(), maxTileBytes);
}
