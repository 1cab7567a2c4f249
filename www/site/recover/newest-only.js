/**
 * Runs `work` for the newest value only: while it runs, the values before the last are dropped.
 *
 * @template T
 * @param {(value: T) => Promise<void>} work handles its own errors
 * @returns {(value: T) => void}
 */
export function newestOnly(work) {
  let isRunning = false;
  /** @type {{ value: T } | undefined} */
  let waiting;
  return async (value) => {
    waiting = { value };
    if (isRunning) return;
    isRunning = true;
    while (waiting) {
      const { value } = waiting;
      waiting = undefined;
      await work(value);
    }
    isRunning = false;
  };
}
