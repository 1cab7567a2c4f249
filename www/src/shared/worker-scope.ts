/** The global scope of a worker; the compiler knows that of pages only. */

/** What a worker is told first. */
export interface Start {
  readonly kind: 'start';
  /** The folder of the modules, where they are not beside the worker. */
  readonly modules: string | null;
}

/** What of it is used, by a worker that is asked for one kind of thing and says another. */
export interface WorkerScope<Request, Answer> {
  onmessage: ((event: MessageEvent<Request>) => void) | null;
  postMessage(message: Answer, transfer?: Transferable[]): void;
}

/** That of the worker that this runs in. */
export function workerScope<Request, Answer>(): WorkerScope<Request, Answer> {
  return globalThis as unknown as WorkerScope<Request, Answer>;
}

/** Waits for a worker's first message. */
export function started(scope: WorkerScope<Start, never>): Promise<Start> {
  return new Promise((resolve) => {
    scope.onmessage = ({ data }) => {
      scope.onmessage = null;
      resolve(data);
    };
  });
}
