/** A photograph as a tile source of OpenSeadragon 6, whose tiles are drawn under a light that may change. */

import { toImageLight } from '../lights/image-pixels.js';
import { multiplyRgb } from '../lights/light-color.js';
import { isLinearLight, type LightImageSource } from '../lights/light-source.js';
import { messageOf } from '../shared/errors.js';
import type { LightName, ToneCurve } from '../shared/keywords.js';
import { parseExposure, parseTone, parseWhiteBalance } from '../shared/setting-parsers.js';
import type { PhotoInfo, RgbGains } from '../shared/value-types.js';
import {
  checkFields,
  type LightOptions,
  NO_OVERRIDES,
  parsePageLight,
} from '../state/page-light.js';
import type { TileFrame, TileRenderer } from './tile-renderer.js';

/** The name of a built-in light, its options, or an image. The time of a fire is in seconds since it was lit. */
export type TileLight =
  | LightName
  | (LightOptions & { readonly seconds?: number })
  | LightImageSource;

/** How the picture is shown. */
export interface TileOutput {
  /** Factor on the picture's brightness. */
  readonly exposure?: number;
  /** Factors on red, green and blue. */
  readonly whiteBalance?: RgbGains;
  /** How brightness above white is shown: `clip` cuts it off, `filmic` compresses it. */
  readonly tone?: ToneCurve;
}

/** A tile of OpenSeadragon; its level 0 is the coarsest. */
export interface ViewerTile {
  readonly level: number;
  readonly x: number;
  readonly y: number;
  readonly tiledImage: ViewerImage | null;
}

/** An `OpenSeadragon.TiledImage`. */
export interface ViewerImage {
  readonly viewer: Viewer;
  readonly source: unknown;
}

/** An `OpenSeadragon.Viewer`. */
export interface Viewer {
  readonly world: {
    requestInvalidate?(restoreTiles: boolean, tStamp: number): PromiseLike<unknown>;
  };
  addHandler(name: string, handler: (event: never) => unknown): unknown;
  removeHandler(name: string, handler: (event: never) => unknown): unknown;
}

/** An `OpenSeadragon.ImageJob`. */
export interface TileJob {
  readonly tile: ViewerTile;
  finish(data: CanvasRenderingContext2D, request: null, type: 'context2d'): void;
  fail(message: string, request: null): void;
}

/** The event `tile-invalidated`. */
interface TileInvalidatedEvent {
  readonly tile: ViewerTile;
  readonly tiledImage: ViewerImage;
  outdated(): boolean;
  setData(data: CanvasRenderingContext2D, type: 'context2d'): PromiseLike<unknown>;
}

/** For `tileSources`, `open` and `addTiledImage` of OpenSeadragon. */
export interface RelightableTileSource {
  readonly width: number;
  readonly height: number;
  readonly tileWidth: number;
  readonly tileHeight: number;
  readonly minLevel: number;
  readonly maxLevel: number;
  getTileUrl(level: number, x: number, y: number): string;
  hasTransparency(): boolean;
  downloadTileStart(job: TileJob): void;
  downloadTileAbort(job: TileJob): void;
}

export class RelightableTiles {
  /** For OpenSeadragon. Several viewers may have it. */
  readonly tileSource: RelightableTileSource;
  #light: TileLight;
  #output: TileOutput;
  #frame: TileFrame;
  /** The frame of a tile's own data, until its first event. */
  readonly #drawn = new WeakMap<ViewerTile, TileFrame>();
  readonly #aborted = new WeakSet<TileJob>();
  /** The viewers that show it, and what stops following each. */
  readonly #viewers = new Map<Viewer, () => void>();
  #redrawing: Promise<void> | null = null;
  /** Why a tile could not be redrawn. */
  #failure: unknown = null;
  #lastStamp = 0;

  /** Takes the renderer over. `src` is the address of the photograph. Throws for an invalid light or output. */
  constructor(
    private readonly renderer: TileRenderer,
    /** What the file says about the photograph. */
    readonly info: PhotoInfo,
    src: string,
    light: TileLight,
    output: TileOutput,
  ) {
    this.#light = light;
    this.#output = output;
    this.#frame = frameOf(light, output);
    const { width, height } = info;
    const side = renderer.table?.shardSide;
    this.tileSource = {
      width,
      height,
      tileWidth: side ?? width,
      tileHeight: side ?? height,
      minLevel: 0,
      maxLevel: renderer.levels - 1,
      getTileUrl: (level, x, y) => `${src}#${level}/${x}_${y}`,
      hasTransparency: () => false,
      downloadTileStart: (job) => void this.#load(job),
      downloadTileAbort: (job) => void this.#aborted.add(job),
    };
  }

  /**
   * Shows the photograph under another light; an image is read again. Settles when the visible tiles are drawn; rejects if
   * one cannot be, which keeps its last light.
   */
  setLight(light: TileLight): Promise<void> {
    this.#frame = frameOf(light, this.#output);
    this.#light = light;
    return this.#redraw();
  }

  /** Shows the picture in another way. Settles as `setLight` does. */
  setOutput(output: TileOutput): Promise<void> {
    this.#frame = frameOf(this.#light, output);
    this.#output = output;
    return this.#redraw();
  }

  /** Frees its memory. Close its viewers, or remove it from them, before. */
  free(): void {
    for (const stop of [...this.#viewers.values()]) stop();
    this.renderer.free();
  }

  async #load(job: TileJob): Promise<void> {
    const { tile } = job;
    try {
      const frame = this.#frame;
      const context = await this.#draw(tile, frame);
      if (this.#aborted.has(job)) return;
      this.#drawn.set(tile, frame);
      if (tile.tiledImage) this.#follow(tile.tiledImage.viewer);
      job.finish(context, null, 'context2d');
    } catch (thrown) {
      if (!this.#aborted.has(job)) job.fail(messageOf(thrown), null);
    }
  }

  #draw({ level, x, y }: ViewerTile, frame: TileFrame): Promise<CanvasRenderingContext2D> {
    return this.renderer.draw({ level: this.renderer.levels - 1 - level, x, y }, frame);
  }

  #follow(viewer: Viewer): void {
    if (this.#viewers.has(viewer)) return;
    if (!viewer.world.requestInvalidate) {
      throw new Error('relightable tiles need OpenSeadragon 6 or later');
    }
    const redraw = (event: TileInvalidatedEvent) => this.#redrawTile(event);
    const stop = () => {
      this.#viewers.delete(viewer);
      viewer.removeHandler('tile-invalidated', redraw);
      viewer.removeHandler('destroy', stop);
    };
    this.#viewers.set(viewer, stop);
    viewer.addHandler('tile-invalidated', redraw);
    viewer.addHandler('destroy', stop);
  }

  /** OpenSeadragon would only log an error, and keep the tile as it is. */
  async #redrawTile(event: TileInvalidatedEvent): Promise<void> {
    const { tile, tiledImage } = event;
    const { downloadTileStart } = tiledImage.source as Partial<RelightableTileSource>;
    if (downloadTileStart !== this.tileSource.downloadTileStart) return;
    const loaded = this.#drawn.get(tile);
    this.#drawn.delete(tile);
    if (loaded === this.#frame) return;
    try {
      const context = await this.#draw(tile, this.#frame);
      if (!event.outdated()) await event.setData(context, 'context2d');
    } catch (thrown) {
      this.#failure = thrown;
    }
  }

  /** A change during a frame is drawn by the next one. */
  #redraw(): Promise<void> {
    this.#redrawing ??= this.#redrawAll().finally(() => {
      this.#redrawing = null;
    });
    return this.#redrawing;
  }

  async #redrawAll(): Promise<void> {
    for (let frame: TileFrame | null = null; frame !== this.#frame; ) {
      frame = this.#frame;
      this.#failure = null;
      // Two of the same time would be one.
      this.#lastStamp = Math.max(Date.now(), this.#lastStamp + 1);
      const viewers = [...this.#viewers.keys()];
      await Promise.all(
        viewers.map(({ world }) => world.requestInvalidate?.(false, this.#lastStamp)),
      );
    }
    if (this.#failure) throw this.#failure;
  }
}

/** Throws a `TypeError` or a `PhotoError` for an invalid value. */
function frameOf(light: TileLight, output: TileOutput): TileFrame {
  const { exposure = 1, whiteBalance = [1, 1, 1], tone = null } = output;
  const { seconds, ...fields } = isOptions(light) ? light : {};
  checkFields({ seconds }, 'light', ['seconds']);
  const parsed = parsePageLight(isOptions(light) ? fields : light, DEFAULTS);
  const { name, torch, size, color, source } = parsed;
  const gains = parseWhiteBalance(whiteBalance.join(' '));
  return {
    light: {
      name: name ?? (torch || size !== null ? 'torch' : 'flood'),
      torch,
      ...(size !== null && { size }),
      ...(seconds !== undefined && { seconds }),
      image: source === null ? null : toImageLight(source as LightImageSource),
    },
    output: {
      exposure: parseExposure(String(exposure)),
      whiteBalance: color ? multiplyRgb(gains, color.factors) : gains,
      tone: parseTone(tone),
    },
  };
}

const DEFAULTS = { ...NO_OVERRIDES, name: 'flood', src: null, crossOrigin: null } as const;

function isOptions(light: TileLight): light is LightOptions & { readonly seconds?: number } {
  return (
    typeof light === 'object' &&
    light !== null &&
    Object.getPrototypeOf(light) === Object.prototype &&
    !isLinearLight(light)
  );
}
