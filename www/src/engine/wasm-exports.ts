/**
 * The exports of the WebAssembly modules. Each module has a memory of its own; photographs move between modules as a
 * descriptor and tiles. `tests/browser/engine-contract.ts` compares these types with those of wasm-bindgen.
 */

import type { Gamut, ToneCurve } from '../shared/keywords.js';
import type { PhotoInfo } from '../shared/value-types.js';

export type { Backend, Gamut, ToneCurve } from '../shared/keywords.js';

/** A picture that a graphics device can upload directly, and that may change at any time. */
export type ExternalImageSource =
  | HTMLCanvasElement
  | OffscreenCanvas
  | ImageBitmap
  | HTMLVideoElement;

/** An object in a module's memory, until it is freed. */
export interface Freeable {
  free(): void;
}

/** What a started module gives beside its functions and classes. */
export interface ModuleExports {
  readonly memory: Pick<WebAssembly.Memory, 'buffer'>;
}

/** A photograph in a module's memory, with some or all of its tiles. */
export interface ModulePhoto extends Freeable {
  /** Moves a tile out; it is dark here afterwards. Not allowed while a CPU relighter uses the photograph. */
  takeTile(index: number): Uint8Array;
}

/** A photograph in the decoder's memory. */
export interface DecodedPhoto extends ModulePhoto, Omit<PhotoInfo, 'metadata'> {
  /** JSON text, which is not validated. */
  readonly metadata: string;
  /** Number of tiles, which are numbered row by row. */
  readonly tiles: number;
  /** Camera pixels along a tile's side; tiles at the right and lower edges may be smaller. */
  readonly tileSide: number;
  /** The arguments of `Photo.receive`. */
  packGeometry(): Float64Array;
  packBasis(): Float32Array;
}

/** A photograph that another module has decoded. */
export interface ImportedPhoto extends ModulePhoto {
  /** Moves a tile of `takeTile` in. Not allowed while a CPU relighter uses the photograph. */
  putTile(index: number, bytes: Uint8Array): void;
  /** The position on the light plane behind a point of the picture: column and row, in light elements. */
  behind(x: number, y: number): Float64Array;
}

/** The emission of the light elements. */
export interface Light extends Freeable {
  /** Linear R, G and B of the rows from `first` to before `end`, row by row. */
  linearRgb(first: number, end: number): Float32Array;
}

/** Decodes one file while it arrives. */
export interface Decoder extends Freeable {
  /** Start and end of each range that is needed, the most important first; empty once the file is complete. */
  wants(): Float64Array;
  /** Feeds bytes of the file that begin at `offset`. Bytes of one range must come in order. */
  feed(offset: number, bytes: Uint8Array): void;
  /** Bytes that were fed; repeated ones count once. */
  readonly bytesFed: number;
  readonly fileBytes: number | undefined;
  /** Bytes of all levels; `fileBytes` if there is one. */
  readonly bytesOfLevels: number | undefined;
  /** The table of levels, as `LevelTable` reads it, once `fileBytes` is known; empty if there is one level. */
  levels(): Float64Array;
  /** Scans that are complete for every tile. */
  readonly scansDone: number;
  /** A coarser photograph; `undefined` before the first scan is complete, and once the file is. */
  preview(): DecodedPhoto | undefined;
  /** The photograph. Ends the decoder, also if it throws. */
  finish(): DecodedPhoto;
}

export interface OutputTransform extends Freeable {}

/** A graphics device, which photographs share. */
export interface GraphicsDevice extends Freeable {
  readonly kernel: string;
  /** Settles when a WebGPU device is lost; `undefined` for WebGL2, whose canvas fires an event. */
  readonly lost: Promise<{ readonly message: string }> | undefined;
  /** Uploads a photograph and draws it on a canvas, which it uses alone. */
  draw(
    photo: ImportedPhoto,
    canvas: HTMLCanvasElement,
    gamut: Gamut,
  ): CanvasRelighter | Promise<CanvasRelighter>;
}

/** Draws one photograph on one canvas. `quality` is the share of the components, 0 to 1. */
export interface CanvasRelighter extends Freeable {
  readonly kernel: string;
  /** The canvas's gamut. */
  readonly gamut: Gamut;
  render(light: Light, transform: OutputTransform, quality: number): void;
  /** Uploads a picture for `renderLightImage`; `false` if the backend cannot. If it throws, the last light stays. */
  setLightImage(picture: ExternalImageSource, width: number, height: number): boolean;
  /** As `render`, with the uploaded picture. */
  renderLightImage(transform: OutputTransform, quality: number): void;
}

/** Relights rows of a picture with the CPU, without a canvas. */
export interface RowRangeRelighter extends Freeable {
  /** The first light row that is needed, and the end of those rows. */
  readonly lightRows: Uint32Array;
  /** The part of the picture that is kept up to date, in pixels; at first all of it. */
  setView(left: number, top: number, right: number, bottom: number): void;
  /**
   * `light` has linear R, G and B of those rows; `null` reuses the last one. Writes RGBA into `out`, row by row; rows out of
   * view are not written.
   */
  relight(
    light: Float32Array | null,
    transform: OutputTransform,
    quality: number,
    out: Uint8Array,
  ): void;
}

export interface DecoderModule {
  /** Gives the started module's exports. */
  default(): Promise<{ readonly memory: Pick<WebAssembly.Memory, 'buffer'> }>;
  /** With `maxTileBytes` it wants the first scans only, as far as their tiles take no more memory. */
  Decoder: { new (maxDecodedBytes?: number, maxTileBytes?: number): Decoder };
}

/** What the modules of all backends export. */
export interface RelightModule {
  Photo: {
    /** Creates a photograph without tiles. */
    receive(geometry: Float64Array, basis: Float32Array): ImportedPhoto;
  };
  /** The photograph may be one without tiles. */
  Light: {
    builtin(photo: ImportedPhoto, name: string): Light;
    /** `u` and `v` are in light elements of the whole light plane, also for a shard. */
    torch(photo: ImportedPhoto, u: number, v: number, size?: number): Light;
    fire(photo: ImportedPhoto, seconds: number): Light;
    /**
     * From linear RGB of a picture of any size, which covers the light plane, row by row; with `elements` from that of the
     * photograph's own elements.
     */
    fromLinear(
      photo: ImportedPhoto,
      values: Float32Array,
      width: number,
      height: number,
      elements?: boolean,
    ): Light;
    /** From sRGB codes with straight alpha of a picture of any size: RGBA, row by row. */
    fromSrgb(photo: ImportedPhoto, rgba: Uint8ClampedArray, width: number, height: number): Light;
  };
  OutputTransform: {
    /** `matrix` is the photograph's colour matrix, row by row, times exposure and white balance. */
    new (matrix: Float32Array, curve: ToneCurve, gamut: Gamut): OutputTransform;
  };
}

export interface CpuModule extends RelightModule {
  /** `simd128` or `scalar`. */
  cpuKernel(): string;
  RowRangeRelighter: {
    new (photo: ImportedPhoto, firstRow: number, rows: number): RowRangeRelighter;
  };
  /** Draws on the calling thread. */
  CanvasRelighter: {
    new (photo: ImportedPhoto, canvas: HTMLCanvasElement, gamut: Gamut): CanvasRelighter;
  };
}

/** The modules of the graphics backends. A WebGL2 device uses its canvas alone. */
export interface GraphicsModules {
  webgl2: RelightModule & { GraphicsDevice: { webgl2(canvas: HTMLCanvasElement): GraphicsDevice } };
  webgpu: RelightModule & { GraphicsDevice: { webgpu(): Promise<GraphicsDevice> } };
}
