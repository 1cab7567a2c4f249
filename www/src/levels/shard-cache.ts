/** The shards in memory, of all elements of the page. Beyond a limit, those that were not seen for longest are freed. */

import { memoryLimit } from '../shared/memory-limit.js';

/** A shard in memory. */
export interface CachedShard {
  /** Memory that it takes: its tiles, and what drawing them needs. */
  readonly bytes: number;
  /** Frees it and has its owner forget it. */
  evict(): void;
}

const MAX_BYTES = 144 * 2 ** 20;
const MAX_BYTES_PER_GIB = 36 * 2 ** 20;

export class ShardCache {
  /** The least recently seen first. */
  readonly #shards = new Set<CachedShard>();
  /** Those that an element needs. */
  readonly #kept = new Map<unknown, ReadonlySet<CachedShard>>();
  /** Those that an element shows. */
  readonly #shown = new Map<unknown, ReadonlySet<CachedShard>>();
  /** Bytes of shards that are being loaded. */
  #reservedBytes = 0;

  constructor(readonly maxBytes = memoryLimit(MAX_BYTES, MAX_BYTES_PER_GIB)) {}

  add(shard: CachedShard): void {
    this.#shards.add(shard);
  }

  /** Makes room for a shard that is to be loaded, as far as nobody sees it. Call the returned function after the load. */
  reserve(bytes: number): () => void {
    this.#reservedBytes += bytes;
    this.#makeRoom(this.#reservedBytes, this.#shown, this.#kept);
    return () => {
      this.#reservedBytes -= bytes;
    };
  }

  /** `owner` shows these, and no others. Those of `kept` are not freed. */
  show(owner: unknown, shards: Iterable<CachedShard>, kept: ReadonlySet<CachedShard>): void {
    const shown = new Set(shards);
    this.#kept.set(owner, kept);
    this.#shown.set(owner, shown);
    for (const shard of shown) {
      this.#shards.delete(shard);
      this.#shards.add(shard);
    }
    this.#makeRoom(0, this.#kept);
  }

  delete(shard: CachedShard): void {
    this.#shards.delete(shard);
  }

  /** `owner` is gone, with its shards. */
  remove(owner: unknown): void {
    this.#kept.delete(owner);
    this.#shown.delete(owner);
  }

  /** Frees shards until `bytes` more fit, but none of `spared`. */
  #makeRoom(bytes: number, ...spared: ReadonlyMap<unknown, ReadonlySet<CachedShard>>[]): void {
    const isSpared = (shard: CachedShard) =>
      spared.some((byOwner) => [...byOwner.values()].some((shards) => shards.has(shard)));
    let excess = bytes - this.maxBytes;
    for (const shard of this.#shards) excess += shard.bytes;
    for (const shard of [...this.#shards]) {
      if (excess <= 0) return;
      if (isSpared(shard)) continue;
      excess -= shard.bytes;
      this.#shards.delete(shard);
      shard.evict();
    }
  }
}
