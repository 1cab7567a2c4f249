/** Several streams of things at once. */

export interface Job<T> {
  /** Runs it; `alone` ends all the others and keeps those to come from starting. */
  run(alone: () => void): AsyncGenerator<T, void>;
  /** Ends it, whatever it waits for. */
  stop(reason?: unknown): void;
}

type Outcome<T> = { readonly result: IteratorResult<T, void> } | { readonly thrown: unknown };
type Step<T> = Outcome<T> & { readonly of: Running<T> };

/** A job under way and the outcome of its next step. */
class Running<T> {
  readonly #job: Job<T>;
  readonly #things: AsyncGenerator<T, void>;
  /** Never rejected, as nobody may be there any more to hear of it. */
  next: Promise<Step<T>>;

  constructor(job: Job<T>, alone: (self: Running<T>) => void) {
    this.#job = job;
    this.#things = job.run(() => alone(this));
    this.next = this.step();
  }

  step(): Promise<Step<T>> {
    return this.#things.next().then(
      (result) => ({ of: this, result }),
      (thrown: unknown) => ({ of: this, thrown }),
    );
  }

  cancel(reason?: unknown): void {
    this.#job.stop(reason);
    // One that waits to be asked for the next thing would not notice.
    void this.#things.return().catch(() => {});
  }
}

/**
 * Hands over what some jobs bring, as it comes, while at most `atOnce` of them are under way. They
 * start in the order of the list. When one fails, when the signal aborts or when nobody wants more,
 * all of them end.
 */
export async function* merge<T>(
  jobs: readonly Job<T>[],
  atOnce: number,
  signal: AbortSignal,
): AsyncGenerator<T, void> {
  signal.throwIfAborted();
  const queue = [...jobs];
  const running: Running<T>[] = [];
  const alone = (kept: Running<T>) => {
    queue.length = 0;
    for (const each of running.splice(0)) {
      if (each === kept) running.push(each);
      else each.cancel();
    }
  };
  const stop = () => {
    for (const each of running) each.cancel(signal.reason);
  };
  signal.addEventListener('abort', stop);
  try {
    for (;;) {
      for (const job of queue.splice(0, atOnce - running.length)) {
        running.push(new Running(job, alone));
      }
      if (running.length === 0) return;
      const step = await Promise.race(running.map(({ next }) => next));
      signal.throwIfAborted();
      // Another job may have ended it since.
      const place = running.indexOf(step.of);
      if (place < 0) continue;
      if ('thrown' in step) throw step.thrown;
      if (step.result.done) {
        running.splice(place, 1);
        continue;
      }
      step.of.next = step.of.step();
      yield step.result.value;
      signal.throwIfAborted();
    }
  } finally {
    signal.removeEventListener('abort', stop);
    stop();
  }
}
