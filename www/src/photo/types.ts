/** The data of a photograph outside a WebAssembly module, and the workers that may hold its tiles. */

import type { DecodedPhoto } from '../engine/wasm-exports.js';
import type { PhotoError } from '../shared/errors.js';

/** A tile as bytes, on its way between two modules. */
export type TransferredTile = Uint8Array<ArrayBuffer>;

/** A photograph without its tiles: what a module needs to create it. */
export interface PhotoDescriptor
  extends Omit<DecodedPhoto, 'takeTile' | 'packGeometry' | 'packBasis' | 'free'> {
  readonly geometry: Float64Array;
  readonly basis: Float32Array;
  /** As `Decoder.levels` gives them. */
  readonly levels: Float64Array;
}

/** A photograph on its way from a worker to the page. */
export interface TransferredPhoto {
  readonly descriptor: PhotoDescriptor;
  readonly tiles: TransferredTile[];
}

/** A photograph that is not a file, for the element's property `photograph`. */
export interface PhotographSource {
  /** Gives the photograph, with tiles of its own at each call. Rejects once `signal` is aborted. */
  load(options: { readonly signal: AbortSignal }): Promise<TransferredPhoto>;
}

/** Those of a photograph of one level. */
const NO_LEVELS: Float64Array = new Float64Array();

/** Moves a photograph out of a module's memory. */
export function takeOut(photo: DecodedPhoto, levels = NO_LEVELS): TransferredPhoto {
  const descriptor = describePhoto(photo, levels);
  const takeTile = (_: unknown, index: number) => photo.takeTile(index) as TransferredTile;
  const tiles = Array.from({ length: descriptor.tiles }, takeTile);
  photo.free();
  return { descriptor, tiles };
}

export function describePhoto(photo: DecodedPhoto, levels = NO_LEVELS): PhotoDescriptor {
  const { width, height, lightWidth, lightHeight, decodedBytes, metadata, tiles, tileSide } = photo;
  const [geometry, basis] = [photo.packGeometry(), photo.packBasis()];
  const info = { width, height, lightWidth, lightHeight, decodedBytes, metadata };
  return { ...info, tiles, tileSide, geometry, basis, levels };
}

/** One photograph's tiles in workers. */
export interface TilesInWorkers {
  /** Why the tiles are lost; `null` while the workers are alive. */
  readonly failure: PhotoError | null;
  /** The indices of the tiles that each worker takes. */
  readonly tiles: readonly (readonly number[])[];
  /** Moves a tile to its worker. If that fails before it is sent, `bytes` are still there. */
  put(index: number, bytes: TransferredTile): Promise<void>;
  take(index: number): Promise<TransferredTile>;
  /** Prepares relighting, once all tiles are there. */
  plan(): Promise<void>;
  end(): void;
}

export interface RelightingPool<S extends TilesInWorkers> {
  /** Rejects with `worker-unavailable`. */
  open(photo: PhotoDescriptor): Promise<S>;
}
