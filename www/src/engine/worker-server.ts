/** The worker's side of `shared/worker-client.ts`, and how the page starts a worker. */

import { messageOf } from '../shared/errors.js';
import { createTrustedWorker } from '../shared/trusted-worker.js';
import { START_ID, type WorkerRequest, type WorkerResponse } from '../shared/worker-client.js';
import { moduleFolder, setModuleFolder } from './wasm-loader.js';

export interface WorkerService<Task, Ready, Result> {
  /** Sent to the page with the news that the worker has started. */
  readonly ready: Ready;
  /** Does one task; gives its result and the buffers to transfer with it. A long task reports the steps it has done. */
  handle(task: Task, onProgress: (steps: number) => void): Answer<Result> | Promise<Answer<Result>>;
}

type Answer<Result> = readonly [Result, Transferable[]];

/**
 * `null` if the page may not have workers. `create` calls `new Worker` with a literal address, for bundlers. The worker
 * finds its module in `folder`, or beside its script.
 */
export function startWorker(create: () => Worker, folder = moduleFolder): Worker | null {
  try {
    const worker = createTrustedWorker(create);
    worker.postMessage(folder);
    return worker;
  } catch {
    return null;
  }
}

/** Runs in a worker: sets a service up, and answers the page's requests with it. */
export function serve<Task, Ready, Result>(
  setUp: () => Promise<WorkerService<Task, Ready, Result>>,
): void {
  // The compiler knows only the global scope of pages; that of a worker has these two members of a message port.
  const scope = globalThis as unknown as Pick<MessagePort, 'onmessage' | 'postMessage'>;
  const send = (message: WorkerResponse<Ready, Result>, transfer: Transferable[] = []): void =>
    scope.postMessage(message, transfer);
  const orReport = async (work: () => void | Promise<void>): Promise<void> => {
    try {
      await work();
    } catch (thrown) {
      send({ kind: 'failed', message: messageOf(thrown) });
    }
  };
  const start = async (modules: typeof moduleFolder): Promise<void> => {
    setModuleFolder(modules);
    const service = await setUp();
    const answer = async ({ id, task }: WorkerRequest<Task>): Promise<void> => {
      const onProgress = (steps: number) => send({ kind: 'progress', id, steps });
      const [result, transfer] = await service.handle(task, onProgress);
      send({ kind: 'done', id, result }, transfer);
    };
    // In order, also if an answer takes several turns of the event loop.
    let last: Promise<void> = Promise.resolve();
    scope.onmessage = ({ data }) => {
      last = last.then(() => orReport(() => answer(data)));
    };
    send({ kind: 'done', id: START_ID, result: service.ready });
  };
  scope.onmessage = ({ data }) => {
    scope.onmessage = null;
    void orReport(() => start(data));
  };
}
