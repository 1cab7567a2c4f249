/** Draws tiles of a photograph, the shards of its levels, under one light after another. */

import type { OutputSettings } from '../engine/output-settings.js';
import { keyOf, LevelTable, type ShardId } from '../levels/level-table.js';
import { type CachedShard, ShardCache } from '../levels/shard-cache.js';
import type { LightSetting } from '../lights/light-setting.js';
import type { LoadedPhotograph } from '../photo/photograph.js';
import type { Renderer } from '../renderers/types.js';
import { photoReleased } from '../shared/errors.js';
import { memoryLimit } from '../shared/memory-limit.js';

const MAX_BYTES = 512 * 2 ** 20;
const MAX_BYTES_PER_GIB = 64 * 2 ** 20;
/** Tiles of a screen, and some around them. */
const TILES_AT_ONCE = 16;
/** Memory for a pixel beside its tiles: the canvas, its copy in a worker, and the picture in linear light. */
const BYTES_PER_PIXEL = 20;

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
    this.#end.signal.throwIfAborted();
    const key = keyOf(id);
    let tile = this.#tiles.get(key);
    if (!tile) {
      tile = new CachedTile(this.#open(id), () => this.#tiles.delete(key));
      this.#tiles.set(key, tile);
      this.#cache.add(tile);
    }
    this.#cache.show(this, [tile], new Set([tile]));
    try {
      return await tile.draw(frame);
    } catch (thrown) {
      this.#cache.delete(tile);
      tile.evict();
      throw thrown;
    }
  }

  free(): void {
    this.#end.abort(photoReleased());
    for (const tile of [...this.#tiles.values()]) tile.evict();
    this.photograph.free();
  }

  async #open(id: ShardId): Promise<OpenTile> {
    const { photograph, table } = this;
    const { signal } = this.#end;
    const root = this.levels - 1;
    if (!table || id.level === root) {
      return { renderer: await this.createRenderer(photograph, signal), photograph: null };
    }
    const maxTileBytes =
      this.#cache.maxBytes / TILES_AT_ONCE - BYTES_PER_PIXEL * table.shardSide ** 2;
    const request = { bytes: table.bytesOf(id), maxTileBytes: Math.max(0, maxTileBytes) };
    const shard = await photograph.openShard?.(request, signal);
    if (!shard) throw photoReleased();
    try {
      table.checkPlace(id, shard.descriptor);
      shard.root = { photograph, scale: 2 ** (root - id.level) };
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
  /** Known once it is open. */
  bytes = 0;
  /** Frames are drawn one after the other. */
  #last: Promise<unknown>;

  constructor(
    private readonly tile: Promise<OpenTile>,
    private readonly forget: () => void,
  ) {
    this.#last = tile.then(({ photograph }) => {
      if (!photograph) return;
      const { width, height, decodedBytes } = photograph.info;
      this.bytes = decodedBytes + BYTES_PER_PIXEL * width * height;
    });
    this.#last.catch(() => {});
  }

  async draw({ light, output }: TileFrame): Promise<CanvasRenderingContext2D> {
    const drawing = this.#last.then(async () => {
      const { renderer } = await this.tile;
      const { lightError } = await renderer.render(light, output, 1);
      if (lightError) throw lightError;
      return copyOf(renderer.canvas);
    });
    this.#last = drawing.catch(() => {});
    return await drawing;
  }

  evict(): void {
    this.forget();
    // The frame that is being drawn ends first.
    void this.#last
      .finally(async () => {
        const { renderer, photograph } = await this.tile;
        renderer.free();
        photograph?.free();
      })
      .catch(() => {});
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
