/**
 * The exports of the WebAssembly module of recovery. `tests/browser/engine-contract.ts` compares these types with those
 * of wasm-bindgen. All pictures are linear, row by row.
 */

import type { DecodedPhoto, Freeable, ModuleExports } from './wasm-exports.js';

/** This worker's place in a group of workers that run one algorithm together, and its connections to the others. */
export interface ProcessGroup {
  /** Number of this worker, from 0 on. */
  readonly rank: number;
  /** Number of workers. */
  readonly size: number;
  /** Sends `own` to the other workers; resolves with the messages of all, in the order of their ranks. */
  exchange(own: Uint8Array[]): Promise<Uint8Array[]>;
}

/** Gets the number of jobs that are done. */
type OnJob = (jobs: number) => void;

/** The measurements of a recovery. */
export interface MeasurementInput extends Freeable {
  readonly width: number;
  readonly height: number;
  readonly shotsUsed: Uint32Array;
  /** Six numbers, row by row. */
  readonly correspondence: Float64Array;
  /** For `unpack` in another worker of a group. */
  pack(): Uint8Array;
}

/** Takes the photographs of a capture folder one by one. */
export interface CaptureBuilder extends Freeable {
  /** The shots whose photographs to add, in this order. */
  readonly shots: Uint32Array;
  addPhotograph(photograph: Float32Array): void;
  /** Ends the builder, also if it throws. */
  finish(): MeasurementInput;
}

/** Takes patterns and photographs one by one. */
export interface MeasurementBuilder extends Freeable {
  /** Subtracted from photographs that are added later. */
  setDark(photograph: Float32Array): void;
  addShot(pattern: Float32Array, photograph: Float32Array, exposure: number): void;
  setCorrespondence(affine: Float64Array): void;
  addGrayCode(isOfRows: boolean, bit: number, inverted: boolean, photograph: Float32Array): void;
  /** Ends the builder, also if it throws. */
  finish(title: string, creator: string, rights: string): MeasurementInput;
}

/** A recovery that is prepared. */
export interface Recovery extends Freeable {
  readonly tiles: number;
  readonly tileColumns: number;
  readonly window: number;
  readonly rank: number | undefined;
  readonly expectedSnr: number | undefined;
  readonly saturatedSamples: number;
  readonly overexposedPixels: number;
  readonly warnings: string[];
  /** For `TileRecovery` in another worker. */
  pack(): Uint8Array;
  /** The first camera row that the tile rows from `first` to `end` depend on. */
  firstRow(first: number): number;
  /** All rows that they depend on, of all photographs. */
  packRows(first: number, end: number): Float32Array;
  recoverTile(index: number): void;
  /** The record for `putTile` of another worker of the group. */
  tileRecord(index: number): Uint8Array;
  putTile(index: number, record: Uint8Array): void;
  encode(
    snr: number | undefined,
    maxBytes: number | undefined,
    lossless: boolean,
    onJob: OnJob,
  ): Uint8Array;
  transport(): RecoveredTransport;
}

/** Recovers tiles for a `Recovery` in another worker. */
export interface TileRecovery extends Freeable {
  setRows(first: number, samples: Float32Array): void;
  /** The record for `putTile`. */
  recoverTile(index: number): Uint8Array;
}

/** The recovered light transport matrix, as browsers relight it. */
export interface RecoveredTransport extends Freeable {
  readonly lightWidth: number;
  readonly lightHeight: number;
  photo(): DecodedPhoto;
  /** Linear R, G and B of the picture under linear R, G and B of all light elements. */
  relight(light: Float32Array): Float32Array;
  /** Energy of the true picture, and of the difference of the picture under its light. */
  pictureError(light: Float32Array, truth: Float32Array): Float64Array;
  transportFunction(x: number, y: number): Float32Array;
  windowOrigin(x: number, y: number): Int32Array;
  pointScatteringFunction(u: number, v: number): Float32Array;
  tileRect(index: number): Uint32Array | undefined;
  tileFunctions(index: number): Float32Array;
}

export interface RecoveryModule {
  default(): Promise<ModuleExports>;
  MeasurementInput: {
    unpack(packed: Uint8Array): MeasurementInput;
  };
  /** From the calibration that a `CaptureReader` gives. */
  CaptureBuilder: { new (calibration: Uint8Array): CaptureBuilder };
  MeasurementBuilder: {
    new (
      width: number,
      height: number,
      lightWidth: number,
      lightHeight: number,
      quantum: number,
    ): MeasurementBuilder;
  };
  Recovery: {
    /** In a group, with workers that call this for the same measurements, or alone. */
    prepare(
      input: MeasurementInput,
      method: string,
      basis: string | undefined,
      window: number | undefined,
      onJob: OnJob,
      group: ProcessGroup | undefined,
    ): Promise<Recovery>;
  };
  /** The emission of the codes 0 to 255. */
  emissionOfCodes(gamma: number): Float32Array;
  TileRecovery: { new (packed: Uint8Array): TileRecovery };
}
