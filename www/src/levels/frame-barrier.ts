/** Lets renderers that compute a frame in workers show it together, so that no edges appear between their parts. */

import { Deferred } from '../shared/promises.js';

export class FrameBarrier {
  readonly #open = new Deferred();

  /** `count` is how often `pass` will be called. */
  constructor(private count: number) {}

  /** Calls `draw` with a function that waits for all others. A renderer that does not call it is not waited for. */
  pass<T>(draw: (ready: () => Promise<void>) => T): T {
    let hasArrived = false;
    const arrive = () => {
      if (!hasArrived) this.count -= 1;
      hasArrived = true;
      if (this.count === 0) this.#open.resolve();
      return this.#open.promise;
    };
    const leave = () => void arrive();
    try {
      const drawn = draw(arrive);
      if (drawn instanceof Promise) drawn.then(leave, leave);
      else leave();
      return drawn;
    } catch (thrown) {
      leave();
      throw thrown;
    }
  }
}
