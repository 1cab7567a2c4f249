/**
 * Draws a photograph of several levels: the root by a renderer of its own, and over it the shards that the view needs, each by
 * another, on a canvas at its place. They arrive in the background; what is there is drawn under the same light.
 *
 * It is a separate script, because most photographs have one level.
 */

import type { OutputSettings } from '../engine/output-settings.js';
import type { LightSetting } from '../lights/light-setting.js';
import type { LoadedPhotograph } from '../photo/photograph.js';
import type { Renderer } from '../renderers/types.js';
import { toPhotoError } from '../shared/errors.js';
import { FrameBarrier } from './frame-barrier.js';
import { keyOf, LevelTable, type PixelRect, type ShardId } from './level-table.js';
import { type CachedShard, ShardCache } from './shard-cache.js';
import { ShardLayer } from './shard-layer.js';
import { ShardLoader } from './shard-loader.js';
import { overlap, selectShards } from './shard-selection.js';

/** Memory for a pixel beside its tiles: the canvas, its copy in a worker, and the picture in linear light. */
const BYTES_PER_PIXEL = 20;
/** Memory for four more components of a pixel. */
const QUAD_BYTES = 24;
/** A view of fewer shards leaves room for others, among them those that are being loaded. */
const MIN_SHARDS = 3;
/** A shard is loaded again for more components if it may have so many times as many. */
const MIN_GAIN = 2;

/** Creates the renderer of a shard. `onLost` is called if its device is lost. */
export type CreateShardRenderer = (
  photograph: LoadedPhotograph,
  onLost: () => void,
  signal: AbortSignal,
) => Promise<Renderer>;

/** What a frame shows. */
interface Frame {
  readonly light: LightSetting;
  readonly output: OutputSettings;
  readonly quality: number;
}

const cache = new ShardCache();

/** Takes `root` over. `photograph` is the one that `root` draws. */
export function createLeveledRenderer(
  root: Renderer,
  photograph: LoadedPhotograph,
  createShardRenderer: CreateShardRenderer,
): Renderer {
  return new LeveledRenderer(root, photograph, createShardRenderer);
}

class LeveledRenderer implements Renderer {
  readonly canvas: Renderer['canvas'];
  readonly kernel: string;
  readonly gamut: Renderer['gamut'];
  readonly qualityController: Renderer['qualityController'];
  readonly layer: HTMLElement;
  readonly #table: LevelTable;
  readonly #layer: ShardLayer;
  readonly #loader: ShardLoader;
  readonly #shards = new Map<string, Shard>();
  #shown: ReadonlySet<Shard> = new Set();
  /** The memory that a shard's tiles may take, if all that the view needs are to fit. */
  #maxTileBytes = 0;

  constructor(
    private readonly root: Renderer,
    private readonly photograph: LoadedPhotograph,
    private readonly createShardRenderer: CreateShardRenderer,
  ) {
    const { canvas, kernel, gamut, qualityController } = root;
    this.canvas = canvas;
    this.kernel = kernel;
    this.gamut = gamut;
    this.qualityController = qualityController;
    this.#table = new LevelTable(photograph.descriptor.levels);
    this.#layer = new ShardLayer(canvas, this.#table);
    this.layer = this.#layer.element;
    this.#loader = new ShardLoader(
      (shard, signal) => this.#load(shard, signal),
      () => performance.now(),
    );
  }

  get warning(): string {
    return this.root.warning ?? '';
  }

  render(light: LightSetting, output: OutputSettings, quality: number) {
    const shown = this.#update();
    const barrier = new FrameBarrier(shown.size + 1);
    const drawings: Promise<unknown>[] = [];
    for (const shard of shown) {
      try {
        const frame = { light, output, quality };
        const drawing = barrier.pass((ready) => shard.draw(frame, ready));
        if (drawing) drawings.push(drawing.catch(() => this.#lose(shard)));
      } catch {
        this.#lose(shard);
      }
    }
    const status = barrier.pass((ready) => this.root.render(light, output, quality, ready));
    // Not before they are drawn.
    const show = () => {
      this.#shown = shown;
      this.#layer.show(shown);
    };
    if (drawings.length > 0 || status instanceof Promise) {
      return Promise.all([status, ...drawings]).then(([result]) => {
        show();
        return result;
      });
    }
    show();
    return status;
  }

  /** The picture in the resolution of the level in use, at most `maxSide` pixels wide and high. */
  snapshot(maxSide: number): HTMLCanvasElement {
    // The canvas of a graphics device keeps its picture only until the next frame.
    for (const shard of this.#shown) shard.redraw();
    return this.#layer.snapshot(this.#shown, this.gamut, maxSide);
  }

  free(): void {
    this.#loader.request([]);
    for (const shard of [...this.#shards.values()]) this.#free(shard);
    cache.remove(this);
    this.#layer.free();
    this.root.free();
  }

  /** Gives the shards of the view that are in memory, and loads the others. */
  #update(): ReadonlySet<Shard> {
    const view = this.#layer.view();
    if (!view) {
      this.#loader.request([]);
      return this.#shown;
    }
    const isLoaded = (id: ShardId) => this.#shards.has(keyOf(id));
    const selection = selectShards(this.#table, view, isLoaded);
    const { needed } = selection;
    const shards = Math.max(needed.length, MIN_SHARDS);
    this.#maxTileBytes = cache.maxBytes / shards - this.#pixelBytes;
    const isShown = ({ id, rect }: Shard) =>
      overlap(rect, view.rect) && (id.level === selection.level || !selection.isComplete);
    const shown = new Set([...this.#shards.values()].filter(isShown));
    cache.show(this, shown);
    this.#loader.request(needed.filter((id) => !isLoaded(id) || this.#mayBeFiner(id)));
    return shown;
  }

  async #load(id: ShardId, signal: AbortSignal): Promise<void> {
    const { photograph } = this;
    try {
      const maxTileBytes = this.#maxTileBytes;
      const bytes = this.#table.bytesOf(id);
      const loaded = await photograph.openShard?.({ bytes, maxTileBytes }, signal);
      if (!loaded) return;
      loaded.root = { photograph, scale: 2 ** (this.#table.levels - 1 - id.level) };
      const rect = this.#table.rectOf(id);
      const shard = new Shard(id, rect, loaded, maxTileBytes, () => this.#free(shard));
      try {
        shard.renderer = await this.createShardRenderer(loaded, () => this.#lose(shard), signal);
        signal.throwIfAborted();
      } catch (thrown) {
        shard.free();
        throw thrown;
      }
      const coarser = this.#shards.get(keyOf(id));
      if (coarser) this.#free(coarser);
      this.#shards.set(keyOf(id), shard);
      cache.add(shard);
      this.#layer.requestFrame();
    } catch (thrown) {
      if (!signal.aborted) this.#layer.report(toPhotoError(thrown));
      throw thrown;
    }
  }

  get #pixelBytes(): number {
    return BYTES_PER_PIXEL * this.#table.shardSide ** 2;
  }

  /** Whether a shard that lacks components would get more of them now. */
  #mayBeFiner(id: ShardId): boolean {
    const shard = this.#shards.get(keyOf(id));
    return shard?.isLimited === true && shard.maxTileBytes < this.#maxTileBytes / MIN_GAIN;
  }

  /** A shard whose worker or device is gone is loaded again. */
  #lose(shard: Shard): void {
    this.#free(shard);
    this.#layer.requestFrame();
  }

  #free(shard: Shard): void {
    cache.delete(shard);
    this.#shards.delete(keyOf(shard.id));
    shard.free();
  }
}

/** A shard in memory. */
class Shard implements CachedShard {
  /** Set before it is drawn. */
  renderer: Renderer | null = null;
  #last: Frame | null = null;

  constructor(
    readonly id: ShardId,
    readonly rect: PixelRect,
    private readonly photograph: LoadedPhotograph,
    readonly maxTileBytes: number,
    readonly evict: () => void,
  ) {}

  /** Whether more components may not have fit. */
  get isLimited(): boolean {
    const { width, height, decodedBytes } = this.photograph.info;
    return decodedBytes + QUAD_BYTES * width * height > this.maxTileBytes;
  }

  get canvas(): HTMLCanvasElement | null {
    return this.renderer?.canvas ?? null;
  }

  get bytes(): number {
    const { width, height, decodedBytes } = this.photograph.info;
    return decodedBytes + BYTES_PER_PIXEL * width * height;
  }

  /** Draws a frame, unless it has drawn the same. */
  draw(frame: Frame, ready: () => Promise<void>): Promise<unknown> | null {
    const last = this.#last;
    const isSame =
      last?.light === frame.light && last.output === frame.output && last.quality === frame.quality;
    // The content of an image may have changed.
    if (isSame && frame.light.image === null) return null;
    this.#last = frame;
    return this.#render(frame, ready);
  }

  /** Draws the last frame again. */
  redraw(): void {
    if (this.#last) void this.#render(this.#last)?.catch(() => {});
  }

  free(): void {
    this.renderer?.canvas.remove();
    this.renderer?.free();
    this.photograph.free();
  }

  #render({ light, output, quality }: Frame, ready?: () => Promise<void>): Promise<unknown> | null {
    const drawn = this.renderer?.render(light, output, quality, ready);
    return drawn instanceof Promise ? drawn : null;
  }
}
