/** The WebAssembly module: its surface, and how the right build of it is found and started. */

import { messageOf, PhotoError } from './errors.js';

/** The name of a back end. */
export type Backend = 'webgpu' | 'webgl2' | 'cpu';

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
  /** Number of tiles. */
  readonly tiles: number;
  /** What `Photo.receive` in another module takes. */
  geometryParcel(): Float64Array;
  basisParcel(): Float32Array;
  /** A tile for another module; it is dark here afterwards. Not once the photograph is drawn. */
  takeTile(index: number): Uint8Array;
  /** Takes a tile that `takeTile` gave. Not once the photograph is drawn. */
  putTile(index: number, bytes: Uint8Array): void;
}

/** What every element of the light plane emits. */
export interface Light extends Freeable {}

/** Says which bytes of a file it wants, and takes them as they come. */
export interface Decoder extends Freeable {
  /** Where ranges begin and end, in turns, the most important first; empty once all has come. */
  wants(): Float64Array;
  /** Takes the file's bytes from `offset` on; those of a range in order. */
  feed(offset: number, bytes: Uint8Array): void;
  /** Each byte counted once. */
  readonly bytesFed: number;
  readonly fileBytes: number | undefined;
  readonly tilesDone: number;
  readonly scansDone: number;
  /** Ends the decoder, whether it succeeds or throws. */
  finish(): Photo;
}

/** One back end, on one canvas. */
export interface Relighter extends Freeable {
  readonly backend: string;
  readonly kernel: string;
  /** Settles when the graphics device goes away, where there is one to itself. */
  readonly lost: Promise<{ readonly message: string }> | undefined;
  render(light: Light, exposure: number): void;
}

/** What the module exports. */
export interface Engine {
  Decoder: { new (maxDecodedBytes?: number): Decoder };
  Photo: {
    /** A photograph that another module decoded, without its tiles as yet. */
    receive(geometry: Float64Array, basis: Float32Array, metadata: string): Photo;
  };
  Light: {
    builtin(photo: Photo, name: string): Light;
    torch(photo: Photo, x: number, y: number, size?: number): Light;
  };
  Relighter: {
    create(backend: Backend, photo: Photo, canvas: HTMLCanvasElement): Promise<Relighter>;
  };
}

// The smallest module with a 128-bit operation: () => i8x16.splat(0), dropped.
const SIMD_PROBE = new Uint8Array([
  0, 97, 115, 109, 1, 0, 0, 0, 1, 4, 1, 96, 0, 0, 3, 2, 1, 0, 10, 9, 1, 7, 0, 65, 0, 253, 15, 26,
  11,
]);

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

async function start(): Promise<Engine> {
  // A build with SIMD does not even load where SIMD is missing, so there are two. The addresses are
  // written out for bundlers, which look for exactly this form.
  const [script, wasm] = WebAssembly.validate(SIMD_PROBE)
    ? [
        new URL('./wasm/relightable_photo.js', import.meta.url),
        new URL('./wasm/relightable_photo_bg.wasm', import.meta.url),
      ]
    : [
        new URL('./wasm/relightable_photo_scalar.js', import.meta.url),
        new URL('./wasm/relightable_photo_scalar_bg.wasm', import.meta.url),
      ];
  const engine = await import(/* @vite-ignore */ /* webpackIgnore: true */ script.href);
  await engine.default({ module_or_path: wasm });
  return engine as Engine;
}
