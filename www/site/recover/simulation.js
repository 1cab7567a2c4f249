/** Calls to the simulation worker, and its end. */

import { PageFault } from './page-fault.js';

/** @typedef {{ resolve: (result: any) => void, reject: (error: Error) => void, onProgress: ((share: number) => void) | undefined }} Call */

export class SimulationWorker {
  /** @type {Worker | undefined} */
  #worker;
  /** @type {Map<number, Call>} */
  #calls = new Map();
  #nextId = 0;

  /**
   * Calls a method of the worker, which starts with the first call.
   *
   * @param {string} method
   * @param {unknown} [args]
   * @param {(share: number) => void} [onProgress]
   * @returns {Promise<any>}
   */
  call(method, args, onProgress) {
    this.#worker ??= this.#start();
    const id = this.#nextId++;
    return new Promise((resolve, reject) => {
      this.#calls.set(id, { resolve, reject, onProgress });
      this.#worker?.postMessage({ id, method, args });
    });
  }

  /** Ends the worker and rejects its calls. The next call starts another. @param {Error} [reason] */
  terminate(reason = new DOMException('The call was cancelled.', 'AbortError')) {
    this.#worker?.terminate();
    this.#worker = undefined;
    const calls = [...this.#calls.values()];
    this.#calls.clear();
    for (const { reject } of calls) reject(reason);
  }

  #start() {
    const worker = new Worker(new URL('simulation-worker.js', import.meta.url), { type: 'module' });
    worker.addEventListener('message', ({ data: { id, result, progress, error, code } }) => {
      const call = this.#calls.get(id);
      if (progress !== undefined) {
        call?.onProgress?.(progress);
        return;
      }
      this.#calls.delete(id);
      if (error === undefined) call?.resolve(result);
      else if (code === 'simulation-unavailable')
        call?.reject(new PageFault(code, { reason: error }));
      else call?.reject(Object.assign(new Error(error), { code }));
    });
    worker.addEventListener('error', (event) => {
      // Without this, the browser would log the error a second time.
      event.preventDefault();
      const reason = event.message || 'simulation-worker.js';
      this.terminate(new PageFault('simulation-unavailable', { reason }));
    });
    return worker;
  }
}
