/** One worker that relights, seen from the page: what it is asked, and what it still owes. */

import { letGo, PhotoError } from '../../shared/errors.js';
import type { Answer, Request, Task } from './protocol.js';

/** What of a worker is used. */
export type WorkerLike = Pick<Worker, 'terminate'> & {
  postMessage(message: Request, transfer: Transferable[]): void;
  onmessage: ((event: MessageEvent<Answer>) => void) | null;
  onerror: ((event: ErrorEvent) => void) | null;
  onmessageerror: ((event: MessageEvent) => void) | null;
};

/** What tells a slow worker from one that is gone: browsers do not tell of all that they end. */
export interface Patience {
  /** How often to look, in milliseconds. */
  readonly lookMs: number;
  /** After how many looks in silence a worker that owes an answer counts as gone. Looks and not time:
   * a page that sleeps looks no more than its workers work. */
  readonly looks: number;
  /** The same for one that has yet to start, which takes a download and a compilation. */
  readonly startLooks: number;
}

/** Somebody waits for an answer. */
interface Waiting {
  readonly photo: number;
  readonly resolve: (bytes: ArrayBuffer) => void;
  readonly reject: (error: PhotoError) => void;
}

/** See the module. */
export class WorkerClient {
  /** What does the work, once the worker is up. Rejects where it does not start. */
  readonly ready: Promise<string>;
  /** Photographs it has rows of, as its crew counts them. */
  photos = 0;
  readonly #worker: WorkerLike;
  readonly #patience: Patience;
  readonly #stopped: (client: WorkerClient) => void;
  readonly #waiting = new Map<number, Waiting>();
  #asked = 0;
  #started = false;
  #silence = false;
  #failure: PhotoError | null = null;
  /** Since it last said something. */
  #looks = 0;
  #look: ReturnType<typeof setTimeout> | undefined;

  /** `stopped` is told once, where the worker fails before it is ended. */
  constructor(worker: WorkerLike, patience: Patience, stopped: (client: WorkerClient) => void) {
    this.#worker = worker;
    this.#patience = patience;
    this.#stopped = stopped;
    this.ready = new Promise((resolve, reject) => {
      // As request number 0, which the worker answers unasked.
      const waiting = { photo: 0, reject, resolve: () => {} };
      this.#waiting.set(0, waiting);
      worker.onmessage = ({ data }) => this.#take(data, resolve);
    });
    this.ready.catch(() => {});
    worker.onerror = (event) => {
      event.preventDefault?.();
      this.#fail(event.message ?? '');
    };
    worker.onmessageerror = () => this.#fail('Its answer could not be read.');
    this.#watch();
  }

  /** Whether the worker has ever been up. */
  get started(): boolean {
    return this.#started;
  }

  /** Whether it was given up for saying nothing, for which it may have had no more than bad luck. */
  get silent(): boolean {
    return this.#silence;
  }

  /** Why the worker is of no use any more; `null` while it is. */
  get failure(): PhotoError | null {
    return this.#failure;
  }

  /**
   * Asks for something, after all that was asked before, and gives the bytes of the answer. Rejects
   * with `worker-unavailable` where the worker is gone, or goes before it answers. What was to be
   * transferred is still here where it never left.
   */
  ask(photo: number, task: Task, transfer: Transferable[] = []): Promise<ArrayBuffer> {
    return new Promise((resolve, reject) => {
      if (this.#failure) {
        reject(this.#failure);
        return;
      }
      const number = this.#asked + 1;
      // Where this throws, nothing has left, and no answer is owed.
      this.#worker.postMessage({ number, photo, task }, transfer);
      this.#asked = number;
      this.#waiting.set(number, { photo, resolve, reject });
      this.#watch();
    });
  }

  /** Lets rows go: what is owed of them nobody waits for any more. */
  forget(photo: number): void {
    for (const [number, waiting] of this.#waiting) {
      if (waiting.photo !== photo) continue;
      this.#waiting.delete(number);
      waiting.reject(letGo());
    }
    if (!this.#failure) void this.ask(photo, { kind: 'close' }).catch(() => {});
  }

  /** Ends the worker. */
  end(): void {
    this.#fail('It was ended.', false);
  }

  #take(answer: Answer, ready: (kernel: string) => void): void {
    this.#looks = 0;
    if (answer.kind === 'broken') {
      this.#fail(answer.message);
      return;
    }
    const number = answer.kind === 'ready' ? 0 : answer.number;
    const waiting = this.#waiting.get(number);
    this.#waiting.delete(number);
    if (answer.kind === 'done') {
      waiting?.resolve(answer.bytes);
    } else {
      this.#started = true;
      ready(answer.kernel);
    }
  }

  #fail(why: string, tell = true): void {
    if (this.#failure) return;
    const what = this.#started
      ? 'A relighting worker stopped.'
      : "A relighting worker did not start: its script has to lie beside the element's, and a content " +
        'security policy has to allow it in worker-src.';
    this.#failure = new PhotoError('worker-unavailable', `${what} ${why}`.trim());
    clearTimeout(this.#look);
    this.#worker.onmessage = null;
    this.#worker.terminate();
    // First, so that who waits finds it done.
    if (tell) this.#stopped(this);
    for (const { reject } of this.#waiting.values()) reject(this.#failure);
    this.#waiting.clear();
  }

  /** Looks after the worker for as long as it owes something. */
  #watch(): void {
    if (this.#look !== undefined) return;
    this.#looks = 0;
    const look = () => {
      this.#look = undefined;
      if (this.#waiting.size === 0) return;
      this.#looks += 1;
      const { lookMs, looks, startLooks } = this.#patience;
      if (this.#looks > (this.#started ? looks : startLooks)) {
        this.#silence = true;
        this.#fail('It does not answer.');
      } else {
        this.#look = setTimeout(look, lookMs);
      }
    };
    this.#look = setTimeout(look, this.#patience.lookMs);
  }
}
