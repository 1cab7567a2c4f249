/** Reports that a visitor has been inactive: first for the wandering torch, later for the kiosk mode. */

import type { callLater } from '../shared/promises.js';

/** The torch wanders again after this time. */
export const REST_MS = 8000;

export class IdleTimer {
  #kioskMs = 0;
  #isActive = false;
  #cancelRest = (): void => {};
  #cancelKiosk = (): void => {};

  /** Calls `rested` after `REST_MS` without input, and `expired` after the kiosk's time, once after each activity. */
  constructor(
    private readonly later: typeof callLater,
    private readonly listener: { rested(): void; expired(): void },
  ) {}

  /** 0 is never. */
  set kioskSeconds(seconds: number) {
    if (1000 * seconds === this.#kioskMs) return;
    this.#kioskMs = 1000 * seconds;
    if (this.#isActive) this.#startKiosk();
  }

  restart(): void {
    this.#isActive = true;
    this.#cancelRest();
    this.#cancelRest = this.later(REST_MS, () => this.listener.rested());
    this.#startKiosk();
  }

  stop(): void {
    this.#isActive = false;
    this.#cancelRest();
    this.#cancelKiosk();
  }

  #startKiosk(): void {
    this.#cancelKiosk();
    if (this.#kioskMs === 0) return;
    this.#cancelKiosk = this.later(this.#kioskMs, () => {
      this.#isActive = false;
      this.listener.expired();
    });
  }
}
