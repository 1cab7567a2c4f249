/** Decoding in a worker of its own, which ends with the photograph and gives its memory back. */

import { PhotoError } from '../shared/errors.js';
import { type DecoderState, type PhotoDecoder, shareOf } from './main-thread-decoder.js';
import { type Head, Photograph, type TileBytes } from './photograph.js';

/** What the page asks of the worker. One thing at a time. */
export type Request =
  | { readonly kind: 'feed'; readonly offset: number; readonly bytes: Uint8Array }
  | { readonly kind: 'preview' | 'finish' };

/** What the worker says. */
export type Answer =
  | { readonly kind: 'ready' | 'fed'; readonly state: DecoderState }
  | { readonly kind: 'head'; readonly head: Head }
  /** One after the other. */
  | { readonly kind: 'tile'; readonly bytes: TileBytes }
  | { readonly kind: 'done' }
  | { readonly kind: 'failed'; readonly code: string; readonly message: string };

/** What of a worker is used. */
export type WorkerLike = Pick<Worker, 'postMessage' | 'terminate'> & {
  onmessage: ((event: MessageEvent<Answer>) => void) | null;
  onerror: ((event: ErrorEvent) => void) | null;
  onmessageerror: ((event: MessageEvent) => void) | null;
};

/** After so much silence a worker that owes an answer counts as gone: browsers do not tell of all that they
 * end. Looks and not time, as a page that sleeps looks no more than its workers work. */
const PATIENCE = { lookMs: 1000, looks: 30 };

/** Somebody waits for the next answers. */
interface Waiting {
  readonly take: (answer: Answer) => void;
  readonly fail: (error: PhotoError) => void;
}

/** See the module. */
export class WorkerDecoder implements PhotoDecoder {
  readonly #worker: WorkerLike;
  readonly #patience: typeof PATIENCE;
  #state: DecoderState = { bytesFed: 0, fileBytes: undefined, scansDone: 0, next: undefined };
  #waiting: Waiting | null = null;
  #failure: PhotoError | null = null;
  /** Since it last said something. */
  #looks = 0;

  private constructor(worker: WorkerLike, patience: typeof PATIENCE) {
    this.#worker = worker;
    this.#patience = patience;
    worker.onmessage = ({ data }) => {
      this.#looks = 0;
      if (data.kind === 'failed') this.#fail(new PhotoError(data.code, data.message));
      else this.#waiting?.take(data);
    };
    const died = (why: string) =>
      this.#fail(new PhotoError('worker-unavailable', `The decoding worker stopped. ${why}`));
    worker.onerror = (event) => {
      event.preventDefault?.();
      died(event.message ?? '');
    };
    worker.onmessageerror = () => died('Its answer could not be read.');
  }

  /** A decoder in `worker`, once it is up. Rejects where it does not start. */
  static async start(worker: WorkerLike, patience = PATIENCE): Promise<WorkerDecoder> {
    const decoder = new WorkerDecoder(worker, patience);
    try {
      await decoder.#until('ready');
      return decoder;
    } catch (thrown) {
      decoder.free();
      throw thrown;
    }
  }

  get state(): DecoderState {
    return this.#state;
  }

  async feed(offset: number, bytes: Uint8Array): Promise<void> {
    this.#ask({ kind: 'feed', offset, bytes });
    await this.#watched(this.#until('fed'));
  }

  async preview(): Promise<Photograph | null> {
    return await this.#photograph('preview', shareOf(this.#state));
  }

  async finish(): Promise<Photograph> {
    try {
      const photograph = await this.#photograph('finish', 1);
      if (photograph) return photograph;
      throw new PhotoError('internal', 'The decoding worker gave no photograph.');
    } finally {
      this.free();
    }
  }

  free(): void {
    this.#worker.terminate();
    this.#fail(new PhotoError('internal', 'The decoding worker was ended.'));
  }

  async #photograph(kind: 'preview' | 'finish', share: number): Promise<Photograph | null> {
    this.#ask({ kind });
    const heads: Head[] = [];
    const tiles: TileBytes[] = [];
    const done = this.#until('done', (answer) => {
      if (answer.kind === 'head') heads.push(answer.head);
      else if (answer.kind === 'tile') tiles.push(answer.bytes);
    });
    await this.#watched(done);
    const [head] = heads;
    if (!head) return null;
    if (head.tiles === tiles.length) return Photograph.received(head, tiles, share);
    throw new PhotoError('internal', 'The decoding worker gave a part of a photograph.');
  }

  #ask(request: Request): void {
    if (!this.#failure) this.#worker.postMessage(request);
  }

  /** Waits for an answer of that kind; those before it go to `each`. */
  #until(kind: Answer['kind'], each: (answer: Answer) => void = () => {}): Promise<void> {
    return new Promise((resolve, reject) => {
      if (this.#failure) {
        reject(this.#failure);
        return;
      }
      const end = () => {
        this.#waiting = null;
      };
      this.#waiting = {
        take: (answer) => {
          try {
            if ('state' in answer) this.#state = answer.state;
            each(answer);
            if (answer.kind !== kind) return;
            end();
            resolve();
          } catch (thrown) {
            end();
            reject(thrown);
          }
        },
        fail: (error) => {
          end();
          reject(error);
        },
      };
    });
  }

  /** Fails where the worker, which is up, says nothing for too long. */
  async #watched(answer: Promise<void>): Promise<void> {
    this.#looks = 0;
    const watch = setInterval(() => {
      this.#looks += 1;
      if (this.#looks <= this.#patience.looks) return;
      const message = 'The decoding worker stopped. It does not answer. Load the photograph again.';
      this.#fail(new PhotoError('worker-unavailable', message));
    }, this.#patience.lookMs);
    try {
      await answer;
    } finally {
      clearInterval(watch);
    }
  }

  #fail(error: PhotoError): void {
    this.#failure ??= error;
    this.#waiting?.fail(this.#failure);
  }
}
