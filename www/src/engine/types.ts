/** The WebAssembly modules: their surfaces. */

import type { Gamut, ModuleName, ToneCurve } from '../shared/names.js';

export type { Backend, Gamut, ToneCurve } from '../shared/names.js';

/** A picture that a graphics device can upload directly, and that may change at any time. */
export type LivePicture = HTMLCanvasElement | OffscreenCanvas | ImageBitmap | HTMLVideoElement;

/** Holds memory inside the module until freed. */
export interface Freeable {
  free(): void;
}

/** A photograph in the memory of a module, or as many of its tiles as are there. */
export interface Photo extends Freeable {
  /** A tile for another module; it is dark here afterwards. Not while a CPU is at the photograph. */
  takeTile(index: number): Uint8Array;
}

/** One that was decoded. */
export interface DecodedPhoto extends Photo {
  readonly width: number;
  readonly height: number;
  readonly lightWidth: number;
  readonly lightHeight: number;
  /** Text that should be a JSON object. */
  readonly metadata: string;
  readonly decodedBytes: number;
  /** Number of tiles, which lie row by row. */
  readonly tiles: number;
  /** Pixels along a tile's side; those at the right and lower edges may be smaller. */
  readonly tileSide: number;
  /** What `Photo.receive` of another module takes. */
  geometryParcel(): Float64Array;
  basisParcel(): Float32Array;
}

/** One that another module decoded, to be drawn. */
export interface DrawnPhoto extends Photo {
  /** Takes a tile that `takeTile` gave. Not while a CPU is at the photograph. */
  putTile(index: number, bytes: Uint8Array): void;
}

/** What every element of the light plane emits. */
export interface Light extends Freeable {
  /** Linear R, G and B of the rows from `first` up to `end`, row by row. */
  linearRgb(first: number, end: number): Float32Array;
}

/** Says which bytes of a file it wants, and takes them as they come. */
export interface Decoder extends Freeable {
  /** Where ranges begin and end, in turns, the most important first; empty once all has come. */
  wants(): Float64Array;
  /** Takes the file's bytes from `offset` on; those of a range in order. */
  feed(offset: number, bytes: Uint8Array): void;
  /** Each byte counted once. */
  readonly bytesFed: number;
  readonly fileBytes: number | undefined;
  /** Scans that are there for every tile. */
  readonly scansDone: number;
  /**
   * A coarser photograph of what has come of every tile; none before the first scan is there, and once all
   * is.
   */
  preview(): DecodedPhoto | undefined;
  /** Ends the decoder, whether it succeeds or throws. */
  finish(): DecodedPhoto;
}

/** How a picture is shown. */
export interface Display extends Freeable {}

/** A graphics device, which photographs share. */
export interface Graphics extends Freeable {
  readonly kernel: string;
  /** Settles when a WebGPU device goes away; the canvas of a WebGL2 context tells itself. */
  readonly lost: Promise<{ readonly message: string }> | undefined;
  /** Brings a photograph to the device, to be drawn into a canvas of its own. */
  draw(photo: DrawnPhoto, canvas: HTMLCanvasElement, gamut: Gamut): Relighter | Promise<Relighter>;
}

/** One photograph, on one canvas. */
export interface Relighter extends Freeable {
  readonly kernel: string;
  /** What the canvas shows. */
  readonly gamut: Gamut;
  /** By a share of the components, from 0 to 1, which is all. */
  render(light: Light, display: Display, detail: number): void;
  /**
   * Takes a picture of so many pixels as the light of `renderPicture`; `false` where this back end cannot.
   * Throws what the browser does; the last light stays.
   */
  takePicture(picture: LivePicture, width: number, height: number): boolean;
  /** As `render`, under the picture that was taken last. */
  renderPicture(display: Display, detail: number): void;
}

/** The CPU at work on some rows of a picture, without a canvas. */
export interface BandRelighter extends Freeable {
  /** The first row of the light that is seen, and the first after it that is not. */
  readonly lightRows: Uint32Array;
  /**
   * Takes linear R, G and B of those rows, or the last ones again, and a share of the components, and
   * writes RGBA into `out`, row by row.
   */
  relight(light: Float32Array | null, display: Display, detail: number, out: Uint8Array): void;
}

/** The module that decodes. */
export interface DecoderModule {
  Decoder: { new (maxDecodedBytes?: number): Decoder };
}

/** What every module that draws has. */
export interface DrawingModule {
  Photo: {
    /** A photograph that another module decoded, without its tiles as yet. */
    receive(geometry: Float64Array, basis: Float32Array): DrawnPhoto;
  };
  /** A photograph without tiles will do for those. */
  Light: {
    builtin(photo: DrawnPhoto, name: string): Light;
    torch(photo: DrawnPhoto, x: number, y: number, size?: number): Light;
    /** A fire that has burnt for so many seconds. */
    fire(photo: DrawnPhoto, seconds: number): Light;
    /** A picture of any size, in linear RGB, row by row. */
    fromLinear(photo: DrawnPhoto, values: Float32Array, width: number, height: number): Light;
    /** A picture of any size, in sRGB: RGBA, row by row, colours apart from alpha. */
    fromSrgb(photo: DrawnPhoto, rgba: Uint8ClampedArray, width: number, height: number): Light;
  };
  Display: {
    new (exposure: number, balance: Float64Array, curve: ToneCurve, gamut: Gamut): Display;
  };
}

/** The module that draws on the CPU. */
export interface CpuModule extends DrawingModule {
  /** What relights: `simd128` or `scalar`. */
  cpuKernel(): string;
  BandRelighter: { new (photo: DrawnPhoto, firstRow: number, rows: number): BandRelighter };
  /** One that draws on this thread. */
  Relighter: { new (photo: DrawnPhoto, canvas: HTMLCanvasElement, gamut: Gamut): Relighter };
}

/** The module that draws by WebGPU. */
export interface WebGpuModule extends DrawingModule {
  Graphics: { webgpu(): Promise<Graphics> };
}

/** The module that draws by WebGL2. */
export interface WebGl2Module extends DrawingModule {
  /** On a canvas for it alone. */
  Graphics: { webgl2(canvas: HTMLCanvasElement): Graphics };
}

/** All modules by name. Each has a memory of its own. */
export interface Modules extends Record<ModuleName, unknown> {
  decoder: DecoderModule;
  cpu: CpuModule;
  webgl2: WebGl2Module;
  webgpu: WebGpuModule;
}
