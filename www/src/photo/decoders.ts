/** Which thread decodes: a worker's where there can be one, else the page's. */

import { loadDecoder } from '../engine/decoder-module.js';
import { moduleFolder } from '../engine/wasm-loader.js';
import type { Start } from '../shared/worker-scope.js';
import { MainThreadDecoder, type PhotoDecoder } from './main-thread-decoder.js';
import { WorkerDecoder } from './worker-decoder.js';

/** How long a worker may take to start, which takes a download and a compilation. */
const START_MS = 15_000;

/** A decoder for one photograph. */
export async function newDecoder(): Promise<PhotoDecoder> {
  const worker = startWorker();
  if (worker) {
    const started = WorkerDecoder.start(worker);
    const decoder = await Promise.race([started.catch(() => null), tooLate()]);
    if (decoder) return decoder;
    worker.terminate();
  }
  // Whatever keeps the module from starting, the page is told of here.
  return new MainThreadDecoder(await loadDecoder(), () => performance.now());
}

/** `null` where a script of this origin may not be a worker, or modules cannot be. */
function startWorker(): Worker | null {
  try {
    // The address is written out for bundlers, which look for exactly this form.
    const worker = new Worker(new URL('./relightable-photo-worker.js', import.meta.url), {
      type: 'module',
    });
    worker.postMessage({ kind: 'start', modules: moduleFolder() } satisfies Start);
    return worker;
  } catch {
    return null;
  }
}

async function tooLate(): Promise<null> {
  await new Promise((resolve) => setTimeout(resolve, START_MS));
  return null;
}
