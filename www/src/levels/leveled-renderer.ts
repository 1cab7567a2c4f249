/**
 * Draws a photograph of several levels: the root by a renderer of its own, and over it the shards that the view needs, each by
 * another, on a canvas at its place. Shards arrive in the background; those in memory are drawn under the same light.
 *
 * It is a separate script, because most photographs have one level.
 */

import type { OutputSettings } from '../engine/output-settings.js';
import type { AppliedLightStatus } from '../lights/light-cache.js';
import type { LightSetting } from '../lights/light-setting.js';
import type { LoadedPhotograph } from '../photo/photograph.js';
import { QualityController } from '../renderers/quality-controller.js';
import type { FramePart, Renderer } from '../renderers/types.js';
import { PhotoError, toPhotoError } from '../shared/errors.js';
import { allSettledOrThrow } from '../shared/promises.js';
import type { PixelRect } from '../shared/value-types.js';
import { FrameBarrier } from './frame-barrier.js';
import { keyOf, LevelTable, type ShardId } from './level-table.js';
import { BYTES_PER_PIXEL, drawnBytes, openShard } from './open-shard.js';
import { type CachedShard, ShardCache } from './shard-cache.js';
import { ShardLayer } from './shard-layer.js';
import { ShardLoader } from './shard-loader.js';
import { contains, overlap, type PictureView, selectShards } from './shard-selection.js';

/** Memory for four more components of a pixel. */
const QUAD_BYTES = 24;
/** A view of fewer shards leaves room for others, among them those that are being loaded. */
const MIN_SHARDS = 4;
/** A coarser level has as many times fewer pixels. */
const PIXEL_FACTOR = 4;
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
  /** Share of the components. */
  readonly share: number;
  /** The pixels of the shard that are drawn. */
  readonly pixels: PixelRect;
}

const cache = new ShardCache();

export class LeveledRenderer implements Renderer {
  readonly canvas: Renderer['canvas'];
  readonly kernel: string;
  readonly gamut: Renderer['gamut'];
  readonly qualityController = new QualityController(PIXEL_FACTOR);
  readonly layer: HTMLElement;
  readonly #table: LevelTable;
  readonly #layer: ShardLayer;
  readonly #loader: ShardLoader;
  readonly #shards = new Map<string, Shard>();
  #shown = new Set<Shard>();
  /** Those in memory that the view needs; others may be freed. The cache has the same object. */
  #kept = new Set<Shard>();
  /** The codes of errors of loads that were reported. */
  readonly #reported = new Set<string>();
  /** Replaced by finer ones, and on the screen until these are drawn. */
  readonly #outgoing = new Set<Shard>();
  /** How many times four components a shard may have, if all that the view needs are to fit. */
  #quads = 1;

  /** Takes `root` over. `photograph` is the one that `root` draws. */
  constructor(
    private readonly root: Renderer,
    private readonly photograph: LoadedPhotograph,
    private readonly createShardRenderer: CreateShardRenderer,
  ) {
    const { canvas, kernel, gamut } = root;
    this.canvas = canvas;
    this.kernel = kernel;
    this.gamut = gamut;
    this.#table = new LevelTable(photograph.descriptor.levels);
    this.#layer = new ShardLayer(canvas, this.#table, () => this.#hide());
    this.layer = this.#layer.element;
    this.#loader = new ShardLoader(
      (shard, signal) => this.#load(shard, signal),
      () => performance.now(),
    );
  }

  get warning(): string {
    return this.root.warning ?? '';
  }

  /** With less quality it draws a coarser level. Shards often have so few components that fewer of them save little. */
  render(light: LightSetting, output: OutputSettings, quality: number, part: FramePart = {}) {
    const view = this.#layer.view();
    const shown = this.#update(view, quality < 1);
    const share = Math.min(1, PIXEL_FACTOR * quality);
    const drawn = part.onlyInView && view ? view.box : this.#table.picture;
    const barrier = new FrameBarrier(shown.size + 1);
    const drawings: Promise<unknown>[] = [];
    for (const shard of shown) {
      try {
        const pixels = this.#table.pixelsIn(drawn, shard.id, shard.size);
        const frame = { light, output, share, pixels };
        const drawing = barrier.pass((ready) => shard.draw(frame, ready));
        if (drawing) drawings.push(drawing.catch(() => this.#lose(shard)));
      } catch {
        this.#lose(shard);
      }
    }
    const status = barrier.pass((ready) => {
      const id = { level: this.#table.levels - 1, x: 0, y: 0 };
      const rect = part.hasOverview ? this.#table.picture : drawn;
      const pixels = this.#table.pixelsIn(rect, id, this.canvas);
      return this.root.render(light, output, share, { view: pixels, ready });
    });
    // Not before they are drawn.
    const show = () => {
      for (const shard of shown) if (shard.isFreed) shown.delete(shard);
      for (const shard of this.#shown) if (!shown.has(shard)) shard.forget();
      this.#shown = shown;
      this.#layer.show(shown);
      cache.show(this, shown, this.#kept);
      // A shard that was replaced during the frame is shown until the next frame.
      for (const shard of this.#outgoing) {
        if (shown.has(shard)) continue;
        this.#outgoing.delete(shard);
        this.#free(shard);
      }
    };
    if (drawings.length > 0 || status instanceof Promise) {
      return this.#afterAll(status, drawings, show);
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
    for (const shard of [...this.#shards.values(), ...this.#outgoing]) this.#free(shard);
    cache.remove(this);
    this.#layer.free();
    this.root.free();
  }

  async #afterAll(
    status: AppliedLightStatus | Promise<AppliedLightStatus>,
    drawings: readonly Promise<unknown>[],
    show: () => void,
  ): Promise<AppliedLightStatus> {
    const all = await allSettledOrThrow<unknown>([Promise.resolve(status), ...drawings]);
    show();
    return all[0] as AppliedLightStatus;
  }

  /** Nobody sees the picture: its shards may be freed. */
  #hide(): void {
    this.#loader.request([]);
    this.#kept = new Set();
    cache.show(this, [], this.#kept);
  }

  /** Gives the shards of the view that are in memory, and loads the others. */
  #update(view: PictureView | null, isCoarse: boolean): Set<Shard> {
    if (!view) {
      this.#hide();
      return new Set();
    }
    const isLoaded = (id: ShardId) => this.#shards.has(keyOf(id));
    const { pixels } = this;
    const maxShards = Math.floor(cache.maxBytes / ((BYTES_PER_PIXEL + QUAD_BYTES) * pixels));
    const limit = Math.max(maxShards, MIN_SHARDS);
    const selection = selectShards(this.#table, view, isLoaded, limit, isCoarse);
    const { needed } = selection;
    const bytes = cache.maxBytes / Math.max(needed.length, MIN_SHARDS);
    const quads = Math.max(1, (bytes / pixels - BYTES_PER_PIXEL) / QUAD_BYTES);
    // Of few sizes, so that a shard takes the place of another in memory that never shrinks.
    this.#quads = 2 ** Math.floor(Math.log2(quads));
    const isShown = ({ id, rect }: Shard) =>
      overlap(rect, view.rect) && (id.level === selection.level || !selection.isComplete);
    const shown = new Set([...this.#shards.values()].filter(isShown));
    const keys = new Set(needed.map(keyOf));
    this.#kept = new Set([...this.#shards.values()].filter(({ id }) => keys.has(keyOf(id))));
    // Those on the screen stay until the others are drawn, if there is room.
    cache.show(this, [...this.#shown, ...shown], this.#kept);
    this.#loader.request(needed.filter((id) => !isLoaded(id) || this.#mayBeFiner(id)));
    const isComing = (id: ShardId) => id.level > selection.level && this.#loader.isLoading(id);
    if (selection.isPending && needed.some(isComing)) this.qualityController.discardFrames();
    return shown;
  }

  async #load(id: ShardId, signal: AbortSignal): Promise<void> {
    const { photograph } = this;
    const quads = this.#quads;
    const maxTileBytes = quads * QUAD_BYTES * this.pixels;
    const release = cache.reserve(maxTileBytes + BYTES_PER_PIXEL * this.pixels);
    try {
      const loaded = await openShard(photograph, this.#table, id, maxTileBytes, signal);
      if (!loaded) return;
      const shard = new Shard(id, this.#table.rectOf(id), loaded, quads, () => this.#free(shard));
      try {
        shard.renderer = await this.createShardRenderer(loaded, () => this.#lose(shard), signal);
        signal.throwIfAborted();
        if (shard.isFreed) throw new PhotoError('backend-lost', 'Its device was lost at once.');
      } catch (thrown) {
        shard.free();
        throw thrown;
      }
      const coarser = this.#shards.get(keyOf(id));
      if (coarser) this.#outgoing.add(coarser);
      this.#shards.set(keyOf(id), shard);
      // Before the end of a frame that does not know it.
      this.#kept.add(shard);
      cache.add(shard);
      this.#layer.requestFrame();
    } catch (thrown) {
      const error = toPhotoError(thrown);
      if (!signal.aborted && !this.#reported.has(error.code)) {
        this.#reported.add(error.code);
        this.#layer.report(error);
      }
      throw error;
    } finally {
      release();
    }
  }

  /** Pixels of a shard. */
  private get pixels(): number {
    return this.#table.shardSide ** 2;
  }

  /** Whether a shard that lacks components would get more of them now. */
  #mayBeFiner(id: ShardId): boolean {
    const shard = this.#shards.get(keyOf(id));
    return shard?.isLimited === true && shard.quads * MIN_GAIN <= this.#quads;
  }

  /** A shard whose worker or device is gone is loaded again. */
  #lose(shard: Shard): void {
    this.#free(shard);
    this.#layer.requestFrame();
  }

  #free(shard: Shard): void {
    cache.delete(shard);
    const key = keyOf(shard.id);
    if (this.#shards.get(key) === shard) this.#shards.delete(key);
    this.#shown.delete(shard);
    shard.free();
  }
}

/** A shard in memory. */
class Shard implements CachedShard {
  /** Set before it is drawn. */
  renderer: Renderer | null = null;
  #last: Frame | null = null;
  #isInWorkers = false;
  isFreed = false;

  constructor(
    readonly id: ShardId,
    readonly rect: PixelRect,
    private readonly photograph: LoadedPhotograph,
    /** How many times four components it may have. */
    readonly quads: number,
    readonly evict: () => void,
  ) {}

  get size() {
    return this.photograph.info;
  }

  /** Whether more components may not have fit. */
  get isLimited(): boolean {
    const { width, height, decodedBytes } = this.photograph.info;
    return decodedBytes > (this.quads - 1) * QUAD_BYTES * width * height;
  }

  get canvas(): HTMLCanvasElement | null {
    return this.renderer?.canvas ?? null;
  }

  get bytes(): number {
    return drawnBytes(this.photograph.info);
  }

  /** Draws a frame, unless it has drawn the same. */
  draw(frame: Frame, ready: () => Promise<void>): Promise<unknown> | null {
    const last = this.#last;
    const isSame =
      last?.light === frame.light && last.output === frame.output && last.share === frame.share;
    // The content of an image may have changed.
    if (isSame && frame.light.image === null && contains(last.pixels, frame.pixels)) return null;
    this.#last = frame;
    return this.#render(frame, ready);
  }

  /** Draws the last frame again, if that is done at once: canvases of the CPU keep their pictures. */
  redraw(): void {
    if (this.#last && !this.#isInWorkers) this.#render(this.#last);
  }

  /** Its canvas leaves the page, and may lose its picture. */
  forget(): void {
    this.#last = null;
  }

  free(): void {
    if (this.isFreed) return;
    this.isFreed = true;
    this.renderer?.canvas.remove();
    this.renderer?.free();
    this.photograph.free();
  }

  #render(frame: Frame, ready?: () => Promise<void>): Promise<unknown> | null {
    if (this.isFreed) return null;
    const { light, output, share, pixels } = frame;
    const drawn = this.renderer?.render(light, output, share, { view: pixels, ready });
    this.#isInWorkers = drawn instanceof Promise;
    return drawn instanceof Promise ? drawn : null;
  }
}
