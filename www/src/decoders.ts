/** Which thread decodes: a worker's where there can be one, else the page's. */

import { LocalDecoder, type PhotoDecoder } from './decoding.js';
import { loadEngine } from './engine.js';
import { WorkerDecoder } from './worker-decoder.js';

/** How long a worker may take to start once the page's own module is there. */
const START_MS = 5000;

/** A decoder for one photograph. */
export async function newDecoder(): Promise<PhotoDecoder> {
  const worker = startWorker();
  if (worker) {
    const started = WorkerDecoder.start(worker, loadEngine);
    const decoder = await Promise.race([started.catch(() => null), tooLate()]);
    if (decoder) return decoder;
    worker.terminate();
  }
  // Whatever keeps the module from starting, the page is told of here.
  return new LocalDecoder(await loadEngine(), () => performance.now());
}

/** `null` where a script of this origin may not be a worker, or modules cannot be. */
function startWorker(): Worker | null {
  try {
    // The address is written out for bundlers, which look for exactly this form.
    return new Worker(new URL('./relightable-photo-worker.js', import.meta.url), {
      type: 'module',
    });
  } catch {
    return null;
  }
}

async function tooLate(): Promise<null> {
  await loadEngine().catch(() => {});
  await new Promise((resolve) => setTimeout(resolve, START_MS));
  return null;
}
