/** Draws tiles of a photograph, the shards of its levels, under one light after another. */

import type { OutputSettings } from '../engine/output-settings.js';
import { keyOf, LevelTable, type ShardId } from '../levels/level-table.js';
import { BYTES_PER_PIXEL, drawnBytes, openShard } from '../levels/open-shard.js';
import { type CachedShard, ShardCache } from '../levels/shard-cache.js';
import type { LightSetting } from '../lights/light-setting.js';
import type { LoadedPhotograph } from '../photo/photograph.js';
import type { Renderer } from '../renderers/types.js';
import { photoReleased } from '../shared/errors.js';
import { memoryLimit } from '../shared/memory-limit.js';

const MAX_BYTES = 512 * 2 ** 20;
const MAX_BYTES_PER_GIB = 64 * 2 ** 20;
/** Tiles of a screen, and some around them, should fit in memory. */
const TILES_OF_SCREEN = 16;
/** Tiles that are opened or drawn at a time. */
const MAX_DRAWINGS = 4;

/** What a tile shows. */
export interface TileFrame {
  readonly light: LightSetting;
  readonly output: OutputSettings;
}

export type CreateTileRenderer = (
  photograph: LoadedPhotograph,
  signal: AbortSignal,
) => Promise<Renderer>;

export class TileRenderer {
  /** `null` for a photograph of one level, which is one tile. */
  readonly table: LevelTable | null;
  readonly #cache: ShardCache;
  readonly #tiles = new Map<string, CachedTile>();
  /** Those that are opened or drawn, which stay in memory; the cache has the same object. */
  readonly #busy = new Set<CachedTile>();
  readonly #waiting: (() => void)[] = [];
  #drawings = 0;
  readonly #end = new AbortController();

  /** Takes the photograph over. It is the last level, if there are several. */
  constructor(
    private readonly photograph: LoadedPhotograph,
    private readonly createRenderer: CreateTileRenderer,
    maxBytes = memoryLimit(MAX_BYTES, MAX_BYTES_PER_GIB),
  ) {
    const { levels } = photograph.descriptor;
    this.table = levels.length > 0 ? new LevelTable(levels) : null;
    this.#cache = new ShardCache(maxBytes);
  }

  /** Number of levels. */
  get levels(): number {
    return this.table?.levels ?? 1;
  }

  /** Draws a tile on a new canvas. Rejects with a `PhotoError`. A tile whose worker is gone is loaded again. */
  async draw(id: ShardId, frame: TileFrame): Promise<CanvasRenderingContext2D> {
    if (this.#drawings >= MAX_DRAWINGS) {
      await new Promise<void>((resolve) => this.#waiting.push(resolve));
    }
    this.#drawings += 1;
    try {
      this.#end.signal.throwIfAborted();
      return await this.#drawNow(this.#tileOf(id), frame);
    } finally {
      this.#drawings -= 1;
      this.#waiting.shift()?.();
    }
  }

  free(): void {
    this.#end.abort(photoReleased());
    for (const tile of [...this.#tiles.values()]) tile.evict();
    this.photograph.free();
  }

  #tileOf(id: ShardId): CachedTile {
    const key = keyOf(id);
    const known = this.#tiles.get(key);
    if (known) return known;
    const tile: CachedTile = new CachedTile(this.#open(id), this.#maxTileBytes, () => {
      if (this.#tiles.get(key) === tile) this.#tiles.delete(key);
    });
    this.#tiles.set(key, tile);
    this.#cache.add(tile);
    return tile;
  }

  async #drawNow(tile: CachedTile, frame: TileFrame): Promise<CanvasRenderingContext2D> {
    this.#busy.add(tile);
    this.#cache.show(this, [tile], this.#busy);
    try {
      return await tile.draw(frame);
    } catch (thrown) {
      this.#cache.delete(tile);
      tile.evict();
      throw thrown;
    } finally {
      this.#busy.delete(tile);
      // Its bytes are known now.
      this.#cache.show(this, [], this.#busy);
    }
  }

  /** Memory for the coefficients of a tile. */
  get #maxTileBytes(): number {
    const pixels = (this.table?.shardSide ?? 0) ** 2;
    return Math.max(0, this.#cache.maxBytes / TILES_OF_SCREEN - BYTES_PER_PIXEL * pixels);
  }

  async #open(id: ShardId): Promise<OpenTile> {
    const { photograph, table } = this;
    const { signal } = this.#end;
    if (!table || id.level === table.levels - 1) {
      return { renderer: await this.createRenderer(photograph, signal), photograph: null };
    }
    const shard = await openShard(photograph, table, id, this.#maxTileBytes, signal);
    if (!shard) throw photoReleased();
    try {
      return { renderer: await this.createRenderer(shard, signal), photograph: shard };
    } catch (thrown) {
      shard.free();
      throw thrown;
    }
  }
}

interface OpenTile {
  readonly renderer: Renderer;
  /** Freed with the tile; `null` for the last level, which stays. */
  readonly photograph: LoadedPhotograph | null;
}

class CachedTile implements CachedShard {
  /** Frames are drawn one after the other. */
  #last: Promise<unknown>;
  #isEvicted = false;

  /** `bytes` is an estimate until it is open. */
  constructor(
    private readonly tile: Promise<OpenTile>,
    public bytes: number,
    private readonly forget: () => void,
  ) {
    this.#last = tile.then(({ photograph }) => {
      this.bytes = photograph ? drawnBytes(photograph.info) : 0;
    });
    this.#last.catch(() => {});
  }

  async draw({ light, output }: TileFrame): Promise<CanvasRenderingContext2D> {
    const drawing = this.#last.then(async () => {
      const { renderer } = await this.tile;
      const { lightError } = await renderer.render(light, output, 1);
      return { context: copyOf(renderer.canvas), lightError };
    });
    this.#last = drawing.catch(() => {});
    const { context, lightError } = await drawing;
    if (lightError) throw lightError;
    return context;
  }

  evict(): void {
    if (this.#isEvicted) return;
    this.#isEvicted = true;
    this.forget();
    // The frame that is being drawn ends first.
    const free = async () => {
      const { renderer, photograph } = await this.tile;
      renderer.free();
      photograph?.free();
    };
    void this.#last.then(free, free).catch(() => {});
  }
}

function copyOf(canvas: HTMLCanvasElement): CanvasRenderingContext2D {
  const copy = document.createElement('canvas');
  copy.width = canvas.width;
  copy.height = canvas.height;
  const context = copy.getContext('2d');
  if (!context) throw new Error('the browser has no memory for a canvas');
  context.drawImage(canvas, 0, 0);
  return context;
}
