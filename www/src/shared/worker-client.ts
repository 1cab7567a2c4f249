/** The page's side of one worker, which answers numbered requests. `engine/worker-server.ts` is the worker's side. */

import { joinSentences, PhotoError } from './errors.js';

/** When the watchdog declares a silent worker dead: browsers do not report every worker that they end. */
export interface WatchdogLimits {
  /** Time between two checks, in milliseconds. */
  readonly intervalMs: number;
  /** A worker counts as dead after this many checks without an answer; time would also pass while the page sleeps. */
  readonly maxChecks: number;
  /** The same for a worker that still starts, which includes a download and a compilation. */
  readonly maxStartChecks: number;
}

export interface WorkerRequest<Task> {
  readonly id: number;
  readonly task: Task;
}

export type WorkerResponse<Ready, Result> =
  /** The result of a task; that of `START_ID` says that the worker has started. */
  | { readonly kind: 'done'; readonly id: number; readonly result: Ready | Result }
  /** A task is still in progress: so many of its steps are done. */
  | { readonly kind: 'progress'; readonly id: number; readonly steps: number }
  /** The worker could not start, or could not do a task: its state is undefined from now on. */
  | { readonly kind: 'failed'; readonly message: string };

/** The part of `Worker` that a client uses. */
export type WorkerLike<Task, Ready, Result> = Pick<Worker, 'terminate'> & {
  postMessage(message: WorkerRequest<Task>, transfer: Transferable[]): void;
  onmessage: ((event: MessageEvent<WorkerResponse<Ready, Result>>) => void) | null;
  onerror: ((event: ErrorEvent) => void) | null;
  onmessageerror: ((event: MessageEvent) => void) | null;
};

export interface WorkerClientOptions {
  /** The worker's name in error messages: "decoding worker". */
  readonly name: string;
  readonly limits: WatchdogLimits;
  /** What to do if the worker has stopped, or cannot start, for error messages. */
  readonly remedy: string;
  /** Called once if the worker fails before `terminate`; the pending requests reject afterwards. */
  readonly onFailure?: () => void;
}

/** The id of the response to the start, which no request has. */
export const START_ID = 0;

interface PendingRequest<Result> {
  readonly resolve: (result: Result) => void;
  readonly reject: (error: PhotoError) => void;
  readonly onProgress?: OnProgress | undefined;
}

/** Gets the number of steps that are done of a long task. */
type OnProgress = (steps: number) => void;

export class WorkerClient<Task, Ready, Result> {
  /** Settles when the worker has started, or cannot. */
  readonly ready: Promise<Ready>;
  readonly #pending = new Map<number, PendingRequest<never>>();
  /** Why the worker is unusable; `null` while it works. */
  failure: PhotoError | null = null;
  hasStarted = false;
  /** Whether the watchdog gave the worker up, which another worker may not repeat. */
  isSilent = false;
  #lastId = START_ID;
  #watchdog: ReturnType<typeof setInterval> | undefined;

  constructor(
    private readonly worker: WorkerLike<Task, Ready, Result>,
    private readonly options: WorkerClientOptions,
  ) {
    this.ready = new Promise((resolve, reject) => {
      this.#pending.set(START_ID, { resolve, reject });
    });
    this.ready.catch(() => {});
    worker.onmessage = ({ data }) => this.#receive(data);
    worker.onerror = (event) => {
      event.preventDefault?.();
      this.#fail(event.message ?? '');
    };
    worker.onmessageerror = () => this.#fail('The browser could not read its answer.');
    this.#watch(options.limits.maxStartChecks);
  }

  /**
   * Sends a task; the worker does tasks in order. Rejects with `worker-unavailable` if the worker has failed, or fails
   * before it answers, and with the browser's error if it cannot send the message; then nothing has been transferred.
   */
  request(task: Task, transfer: Transferable[] = [], onProgress?: OnProgress): Promise<Result> {
    return new Promise((resolve, reject) => {
      if (this.failure) throw this.failure;
      const id = this.#lastId + 1;
      this.worker.postMessage({ id, task }, transfer);
      this.#lastId = id;
      this.#pending.set(id, { resolve, reject, onProgress });
      if (this.#pending.size === 1) this.#watch(this.options.limits.maxChecks);
    });
  }

  /** Rejects everything that is pending. */
  terminate(): void {
    this.#fail('It was ended.', false);
  }

  #receive(response: WorkerResponse<Ready, Result>): void {
    if (response.kind === 'failed') {
      this.#fail(response.message);
      return;
    }
    this.hasStarted = true;
    const pending = this.#pending.get(response.id);
    if (response.kind === 'progress') pending?.onProgress?.(response.steps);
    else {
      this.#pending.delete(response.id);
      pending?.resolve(response.result as never);
    }
    if (this.#pending.size > 0) this.#watch(this.options.limits.maxChecks);
    else clearInterval(this.#watchdog);
  }

  #watch(maxChecks: number): void {
    clearInterval(this.#watchdog);
    let checks = 0;
    this.#watchdog = setInterval(() => {
      checks += 1;
      if (checks <= maxChecks) return;
      this.isSilent = true;
      this.#fail('It does not answer.');
    }, this.options.limits.intervalMs);
  }

  #fail(reason: string, isReported = true): void {
    if (this.failure) return;
    const { name, remedy, onFailure } = this.options;
    const summary = `The ${name} ${this.hasStarted ? 'stopped' : 'did not start'}.`;
    const message = joinSentences([summary, reason, remedy]);
    const failure = new PhotoError('worker-unavailable', message);
    this.failure = failure;
    clearInterval(this.#watchdog);
    this.worker.onmessage = null;
    this.worker.terminate();
    // Before the rejections, so that their handlers see the final state.
    if (isReported) onFailure?.();
    for (const { reject } of this.#pending.values()) reject(failure);
    this.#pending.clear();
  }
}
