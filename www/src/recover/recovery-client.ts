/** The page's side of a recovery worker: typed calls, and errors with their codes. */

import { PhotoError } from '../shared/errors.js';
import { type WatchdogLimits, WorkerClient } from '../shared/worker-client.js';
import type { RecoveryCalls, RecoveryWorker, RecoveryWorkerClient } from './protocol.js';

/** Progress counts as an answer, so only a single job must not take longer. */
const LIMITS: WatchdogLimits = { intervalMs: 1000, maxChecks: 120, maxStartChecks: 120 };

const OPTIONS = {
  name: 'recovery worker',
  remedy: 'Close other tabs, or recover with fewer camera pixels or photographs.',
};

export interface CallOptions {
  readonly transfer?: Transferable[];
  /** Gets the number of steps that are done. */
  readonly onProgress?: ((steps: number) => void) | undefined;
}

export class RecoveryClient {
  readonly #client: RecoveryWorkerClient;

  constructor(worker: RecoveryWorker, limits = LIMITS) {
    this.#client = new WorkerClient(worker, { ...OPTIONS, limits });
  }

  /** Rejects if the worker or its module cannot start. */
  async ready(): Promise<void> {
    const error = await this.#client.ready;
    if (error) throw new PhotoError(error.code, error.message);
  }

  /** The worker answers calls in order. */
  async call<M extends keyof RecoveryCalls>(
    method: M,
    args: Parameters<RecoveryCalls[M]>,
    { transfer, onProgress }: CallOptions = {},
  ): Promise<ReturnType<RecoveryCalls[M]>> {
    const request = this.#client.request({ method, args }, transfer, onProgress);
    const result = await request.catch((thrown: unknown) => {
      throw thrown instanceof DOMException ? unsendable(thrown) : thrown;
    });
    if ('value' in result) return result.value as ReturnType<RecoveryCalls[M]>;
    // The state of a module that has stopped is undefined.
    if (result.stopped) this.terminate();
    throw new PhotoError(result.error.code, result.error.message);
  }

  /** Rejects all calls that are pending. */
  terminate(): void {
    this.#client.terminate();
  }
}

function unsendable(cause: DOMException): PhotoError {
  const message = `A picture cannot be sent to the worker: ${cause.message}`;
  return new PhotoError('recover-options', message, cause);
}
