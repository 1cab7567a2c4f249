/** How far the current load is, as `complete`, `error`, `ready` and `:state()` report it. */

import type { PhotoError } from '../shared/errors.js';

/** The names of the states that CSS selects with `:state()`. */
export type LoadPhase = 'loading' | 'ready' | 'error';

export class LoadStatus<T extends HTMLElement> {
  /** `null` before a load starts. */
  phase: LoadPhase | null = null;
  error: PhotoError | null = null;
  /** Resolves once the whole photograph is drawn, and rejects with `error`. Another load has another promise. */
  ready!: Promise<T>;
  #resolve!: (host: T) => void;
  #reject!: (error: PhotoError) => void;
  #isSettled = true;
  readonly #states: CustomStateSet | undefined;

  constructor(private readonly host: T) {
    this.#states = host.attachInternals?.().states;
    this.set(null);
  }

  /** `error` belongs to the phase of that name. */
  set(phase: LoadPhase | null, error: PhotoError | null = null): void {
    if (this.#isSettled) this.#createPromise();
    this.phase = phase;
    this.error = error;
    if (phase === 'ready') this.#resolve(this.host);
    if (error) this.#reject(error);
    this.#isSettled = phase === 'ready' || error !== null;
    try {
      this.#states?.clear();
      if (phase) this.#states?.add(phase);
    } catch {
      // Chrome before 125 accepts only names that begin with dashes.
    }
  }

  #createPromise(): void {
    this.ready = new Promise((resolve, reject) => {
      this.#resolve = resolve;
      this.#reject = reject;
    });
    // The `error` event reports the error; a page need not use the promise.
    this.ready.catch(() => {});
  }
}
