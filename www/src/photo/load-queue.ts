/**
 * The order in which the photographs of a page are loaded: one after another, the nearest to the middle of the viewport
 * first, those out of view last. Loads that waited for the network for a while do not hold up the others.
 */

import { callLater } from '../shared/promises.js';

/** Where an element is: its distance from the middle of the viewport in CSS pixels, plus `OUT_OF_VIEW` outside. */
export type Placement = number;

export const OUT_OF_VIEW = 1e9;

/** A load that gets no data for this long lets the next one start. */
const STALL_MS = 2000;

export interface QueuedLoad {
  readonly placement: Placement;
  /** Whether it may start now; asked in the order of the placements. */
  mayStart(): boolean;
  /** Never rejects. `setWaiting` says whether the load waits for the network. */
  run(setWaiting: (isWaiting: boolean) => void): Promise<void>;
}

export class LoadQueue {
  readonly #waiting = new Set<QueuedLoad>();
  /** The loads in progress that are not stalled. */
  readonly #busy = new Set<QueuedLoad>();
  #isScheduled = false;

  constructor(private readonly stallMs = STALL_MS) {}

  add(load: QueuedLoad): void {
    this.#waiting.add(load);
    this.schedule();
  }

  remove(load: QueuedLoad): void {
    this.#waiting.delete(load);
  }

  /** Starts the next load if it may start, once all elements that a script has added are known. */
  schedule(): void {
    if (this.#isScheduled || this.#waiting.size === 0) return;
    this.#isScheduled = true;
    callLater(0, () => {
      this.#isScheduled = false;
      this.#startNext();
    });
  }

  #startNext(): void {
    if (this.#busy.size > 0) return;
    // Each placement is read once, because that takes a layout of the page.
    const placed = [...this.#waiting].map((load) => ({ load, placement: load.placement }));
    placed.sort((a, b) => a.placement - b.placement);
    const next = placed.find(({ load }) => load.mayStart())?.load;
    if (next) void this.#run(next);
  }

  async #run(load: QueuedLoad): Promise<void> {
    this.#waiting.delete(load);
    this.#busy.add(load);
    let cancelStall = (): void => {};
    let hasEnded = false;
    const setWaiting = (isWaiting: boolean) => {
      // A request may end after its load has failed.
      if (hasEnded) return;
      cancelStall();
      this.#busy.add(load);
      if (!isWaiting) return;
      cancelStall = callLater(this.stallMs, () => {
        this.#busy.delete(load);
        this.schedule();
      });
    };
    await load.run(setWaiting);
    hasEnded = true;
    cancelStall();
    this.#busy.delete(load);
    this.schedule();
  }
}
