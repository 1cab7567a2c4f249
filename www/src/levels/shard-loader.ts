/** Loads shards in the order in which a view needs them, a few at a time, and cancels those that it needs no more. */

import { hasCode } from '../shared/errors.js';
import { callLater } from '../shared/promises.js';
import { keyOf, type ShardId } from './level-table.js';

/** One is decoded while the next arrives. */
const MAX_LOADS = 2;
/** A shard that could not be loaded is tried again after this time, unless the server sends no ranges. */
const RETRY_MS = 15_000;

export class ShardLoader {
  readonly #loads = new Map<string, AbortController>();
  /** When the last attempt failed. */
  readonly #failures = new Map<string, number>();
  #needed: readonly ShardId[] = [];

  /** `load` rejects if it fails, and if its signal is aborted. `now` gives milliseconds. */
  constructor(
    private readonly load: (shard: ShardId, signal: AbortSignal) => Promise<void>,
    private readonly now: () => number,
    private readonly maxLoads = MAX_LOADS,
  ) {}

  /** Loads these, the first first, and no others. */
  request(needed: readonly ShardId[]): void {
    this.#needed = needed;
    const keys = new Set(needed.map(keyOf));
    for (const [key, load] of this.#loads) if (!keys.has(key)) load.abort();
    this.#startNext();
  }

  isLoading(shard: ShardId): boolean {
    return this.#loads.has(keyOf(shard));
  }

  #startNext(): void {
    for (const shard of this.#needed) {
      if (this.#loads.size >= this.maxLoads) return;
      const key = keyOf(shard);
      const failedMs = this.#failures.get(key);
      const mayTry = failedMs === undefined || this.now() - failedMs >= RETRY_MS;
      if (mayTry && !this.#loads.has(key)) void this.#run(shard, key);
    }
  }

  async #run(shard: ShardId, key: string): Promise<void> {
    const abort = new AbortController();
    this.#loads.set(key, abort);
    try {
      await this.load(shard, abort.signal);
      this.#failures.delete(key);
      this.#needed = this.#needed.filter((other) => keyOf(other) !== key);
    } catch (thrown) {
      if (!abort.signal.aborted) {
        this.#failures.set(
          key,
          hasCode(thrown, 'http-range') ? Number.POSITIVE_INFINITY : this.now(),
        );
        callLater(RETRY_MS, () => this.#startNext());
      }
    }
    this.#loads.delete(key);
    this.#startNext();
  }
}
