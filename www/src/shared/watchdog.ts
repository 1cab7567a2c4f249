/** Detects that a worker does not answer any more: browsers do not report every worker that they end. */

/** When a silent worker counts as dead. */
export interface WatchdogLimits {
  /** Time between two checks, in milliseconds. */
  readonly intervalMs: number;
  /**
   * Checks without an answer after which a worker counts as dead. The watchdog counts checks and not time, because a
   * page that sleeps checks no more often than its workers work.
   */
  readonly maxChecks: number;
  /** The same for a worker that still starts, which includes a download and a compilation. */
  readonly maxStartChecks: number;
}

/** Calls back if it is not reset for a number of checks. */
export class Watchdog {
  readonly #intervalMs: number;
  readonly #onTimeout: () => void;
  #timer: ReturnType<typeof setInterval> | undefined;

  constructor(intervalMs: number, onTimeout: () => void) {
    this.#intervalMs = intervalMs;
    this.#onTimeout = onTimeout;
  }

  /** Starts the count, or starts it again. */
  reset(maxChecks: number): void {
    this.stop();
    let checks = 0;
    this.#timer = setInterval(() => {
      checks += 1;
      if (checks > maxChecks) this.#onTimeout();
    }, this.#intervalMs);
  }

  stop(): void {
    clearInterval(this.#timer);
  }
}
