/** The worker's side of `shared/worker-client.ts`, and how the page starts a worker. */

import { messageOf } from '../shared/errors.js';
import { START_ID, type WorkerRequest, type WorkerResponse } from '../shared/worker-client.js';
import { moduleFolder, setModuleFolder } from './wasm-loader.js';

interface StartMessage {
  /** The folder of the WebAssembly modules; `null` if they lie beside the worker. */
  readonly modules: string | null;
}

export interface WorkerService<Task, Ready, Result> {
  /** Sent to the page with the news that the worker has started. */
  readonly ready: Ready;
  /** Does one task; gives its result and the buffers to transfer with it. */
  handle(task: Task): readonly [Result, Transferable[]];
}

/** The part of a worker's global scope that is used; the compiler knows only that of pages. */
interface WorkerScope {
  onmessage: ((event: MessageEvent) => void) | null;
  postMessage(message: unknown, transfer?: Transferable[]): void;
}

/**
 * Starts a worker; `null` if the page may not have it. `create` calls `new Worker` itself, with the address written
 * out, because bundlers look for exactly that form.
 */
export function startWorker(create: () => Worker): Worker | null {
  try {
    const worker = create();
    worker.postMessage({ modules: moduleFolder } satisfies StartMessage);
    return worker;
  } catch {
    return null;
  }
}

/** Runs in a worker: sets a service up, and answers the page's requests with it. */
export function serve<Task, Ready, Result>(
  setUp: () => Promise<WorkerService<Task, Ready, Result>>,
): void {
  const scope = globalThis as unknown as WorkerScope;
  const send = (message: WorkerResponse<Ready, Result>, transfer: Transferable[] = []): void =>
    scope.postMessage(message, transfer);
  const orReport = async (work: () => void | Promise<void>): Promise<void> => {
    try {
      await work();
    } catch (thrown) {
      send({ kind: 'failed', message: messageOf(thrown) });
    }
  };
  const start = async ({ modules }: StartMessage): Promise<void> => {
    setModuleFolder(modules);
    const service = await setUp();
    const answer = ({ id, task }: WorkerRequest<Task>): void => {
      const [result, transfer] = service.handle(task);
      send({ kind: 'done', id, result }, transfer);
    };
    scope.onmessage = ({ data }) => void orReport(() => answer(data));
    send({ kind: 'done', id: START_ID, result: service.ready });
  };
  scope.onmessage = ({ data }) => {
    scope.onmessage = null;
    void orReport(() => start(data));
  };
}
