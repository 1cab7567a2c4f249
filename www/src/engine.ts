/** The WebAssembly module: its surface, and how it is started. */

import { messageOf, PhotoError } from './errors.js';
import type { LivePicture } from './light-source.js';
import { type Gamut, MODULE, type ToneCurve } from './names.js';
import { startWasm } from './wasm-start.js';

export type { Backend, Gamut, ToneCurve } from './names.js';

/** Holds memory inside the module until freed. */
export interface Freeable {
  free(): void;
}

/** A decoded photograph. */
export interface Photo extends Freeable {
  readonly width: number;
  readonly height: number;
  readonly lightWidth: number;
  readonly lightHeight: number;
  readonly metadata: string;
  readonly decodedBytes: number;
  /** Number of tiles, which lie row by row. */
  readonly tiles: number;
  /** Pixels along a tile's side; those at the right and lower edges may be smaller. */
  readonly tileSide: number;
  /** What `Photo.receive` in another module takes. */
  geometryParcel(): Float64Array;
  basisParcel(): Float32Array;
  /** A tile for another module; it is dark here afterwards. Not while a CPU is at the photograph. */
  takeTile(index: number): Uint8Array;
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
  /** Ends the decoder, whether it succeeds or throws. */
  finish(): Photo;
}

/** How a picture is shown. */
export interface Display extends Freeable {}

/** A graphics device, which photographs share. */
export interface Graphics extends Freeable {
  readonly kernel: string;
  /** Whether it is a program that makes up for a missing graphics processor. */
  readonly software: boolean;
  /** Settles when a WebGPU device goes away; the canvas of a WebGL2 context tells itself. */
  readonly lost: Promise<{ readonly message: string }> | undefined;
  /** Brings a photograph to the device, to be drawn into a canvas of its own. */
  draw(photo: Photo, canvas: HTMLCanvasElement, gamut: Gamut): Promise<Relighter>;
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

/** What the module exports. */
export interface Engine {
  /** What relights on the CPU: `simd128` or `scalar`. */
  cpuKernel(): string;
  Decoder: { new (maxDecodedBytes?: number): Decoder };
  Photo: {
    /** A photograph that another module decoded, without its tiles as yet. */
    receive(geometry: Float64Array, basis: Float32Array, metadata: string): Photo;
  };
  Light: {
    builtin(photo: Photo, name: string): Light;
    torch(photo: Photo, x: number, y: number, size?: number): Light;
    /** A picture of any size, in linear RGB, row by row. */
    fromLinear(photo: Photo, values: Float32Array, width: number, height: number): Light;
    /** A picture of any size, in sRGB: RGBA, row by row, colours apart from alpha. */
    fromSrgb(photo: Photo, rgba: Uint8ClampedArray, width: number, height: number): Light;
  };
  BandRelighter: { new (photo: Photo, firstRow: number, rows: number): BandRelighter };
  Display: {
    new (exposure: number, balance: Float64Array, curve: ToneCurve, gamut: Gamut): Display;
  };
  Graphics: {
    webgpu(): Promise<Graphics>;
    /** On a canvas for it alone. */
    webgl2(canvas: HTMLCanvasElement): Graphics;
  };
  /** One that draws on this thread. */
  Relighter: { new (photo: Photo, canvas: HTMLCanvasElement, gamut: Gamut): Relighter };
}

let loading: Promise<Engine> | undefined;

/** The module, loaded once a page; a load that failed is tried again at the next call. */
export function loadEngine(): Promise<Engine> {
  loading ??= start().catch((cause: unknown) => {
    loading = undefined;
    throw new PhotoError(
      'wasm-unavailable',
      'The relighting module could not be started. Its wasm folder has to lie beside the script, and ' +
        "a content security policy has to allow 'wasm-unsafe-eval' in script-src, and the folder's " +
        'address in connect-src. ' +
        `The browser says: ${messageOf(cause)}`,
      cause,
    );
  });
  return loading;
}

// Written out for bundlers, which look for exactly these forms.
async function start(): Promise<Engine> {
  const started = await startWasm({
    name: MODULE,
    glue: () => import('./wasm/relightable_photo.js'),
    simd: () => new URL('./wasm/relightable_photo_bg.wasm', import.meta.url),
    scalar: () => new URL('./wasm/relightable_photo_scalar_bg.wasm', import.meta.url),
  });
  return started as Engine;
}
