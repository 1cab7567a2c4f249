/** How far the current load is, as `complete`, `error`, `ready` and `:state()` report it. */

import type { PhotoError } from '../shared/errors.js';
import { Deferred } from '../shared/promises.js';

/** The names of the states that CSS selects with `:state()`. */
export type LoadPhase = 'loading' | 'ready' | 'error';

export class LoadStatus<T extends HTMLElement> {
  /** `null` before a load starts. */
  phase: LoadPhase | null = null;
  error: PhotoError | null = null;
  #ready!: Deferred<T>;
  #isSettled = true;
  readonly #states: CustomStateSet | undefined;

  constructor(private readonly host: T) {
    this.#states = host.attachInternals?.().states;
    this.set(null);
  }

  /** Resolves once the whole photograph is drawn, and rejects with `error`. Another load has another promise. */
  get ready(): Promise<T> {
    return this.#ready.promise;
  }

  /** `error` belongs to the phase of that name. */
  set(phase: LoadPhase | null, error: PhotoError | null = null): void {
    if (this.#isSettled) this.#createPromise();
    this.phase = phase;
    this.error = error;
    if (phase === 'ready') this.#ready.resolve(this.host);
    if (error) this.#ready.reject(error);
    this.#isSettled = phase === 'ready' || error !== null;
    try {
      this.#states?.clear();
      if (phase) this.#states?.add(phase);
    } catch {
      // Chrome before 125 accepts only names that begin with dashes.
    }
  }

  #createPromise(): void {
    this.#ready = new Deferred();
    // The `error` event reports the error; a page need not use the promise.
    this.#ready.promise.catch(() => {});
  }
}
