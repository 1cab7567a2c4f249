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
  #timer: ReturnType<typeof setInterval> | undefined;
  #checksLeft = 0;

  constructor(
    readonly intervalMs: number,
    readonly onTimeout: () => void,
  ) {}

  get isRunning(): boolean {
    return this.#timer !== undefined;
  }

  /** Starts the count, or starts it again. */
  reset(maxChecks: number): void {
    this.#checksLeft = maxChecks;
    this.#timer ??= setInterval(() => {
      this.#checksLeft -= 1;
      if (this.#checksLeft < 0) this.onTimeout();
    }, this.intervalMs);
  }

  stop(): void {
    clearInterval(this.#timer);
    this.#timer = undefined;
  }
}
