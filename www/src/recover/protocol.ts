/** The calls that a recovery worker answers. A coordinator and the tile workers run the same script. */

import type { TransferredPhoto } from '../photo/types.js';
import type { WorkerClient, WorkerLike } from '../shared/worker-client.js';
import type { GroupMembership } from './process-group.js';
import type {
  Correspondence,
  FileQuality,
  RecoveryMethod,
  SparsityBasis,
  TileFunctions,
  TransportFunction,
} from './types.js';

export const DEFAULT_GAMMA = 2.2;
/** The largest code of 16-bit photographs. */
export const MAX_CODE = 65535;

/** A picture on its way to a worker, which decodes it. */
export type SentPicture =
  /** 8-bit sRGB. */
  | ImageData
  | ImageBitmap
  /** A PNG. */
  | Blob
  | { readonly width: number; readonly height: number; readonly data: Float32Array };

export interface PictureSize {
  readonly width: number;
  readonly height: number;
}

/** What the pictures of a page have in common; the size is that of the photographs. */
export interface PicturesHeader extends PictureSize {
  readonly lightWidth: number;
  readonly lightHeight: number;
  /** Distance of two codes of a photograph, 1 being full scale. */
  readonly quantum: number;
  readonly lightGamma: number;
  readonly black: number;
  readonly white: number;
  readonly title: string;
  readonly creator: string;
  readonly rights: string;
}

/** The measurements, once all are read. */
export interface InputSummary extends PictureSize {
  readonly correspondence: Correspondence;
  readonly shotsUsed: readonly number[];
  readonly unknownFields: readonly string[];
}

export interface PreparationSettings {
  readonly method: RecoveryMethod;
  readonly basis: SparsityBasis | undefined;
  /** Estimated if it is `undefined`. */
  readonly window: number | undefined;
}

export interface PreparationSummary {
  readonly tiles: number;
  readonly tileColumns: number;
  readonly window: number;
  readonly rank: number | undefined;
  readonly expectedSnr: number | undefined;
}

/** The result of a recovery, after its last tile. */
export interface RecoverySummary {
  readonly lightWidth: number;
  readonly lightHeight: number;
  readonly saturatedSamples: number;
  readonly overexposedPixels: number;
  /** Codes, some with numbers after them, separated by spaces: shots, and a percentage. */
  readonly warnings: readonly string[];
}

/** Samples of all photographs in the camera rows from `first` on. */
export interface PackedRows {
  readonly first: number;
  readonly samples: Float32Array;
}

/** Energy of true pictures, and of the difference of predicted pictures. */
export interface PictureError {
  readonly signal: number;
  readonly error: number;
}

/** The coordinator reads, prepares, keeps the tiles and answers questions about the result. */
export interface CoordinatorCalls {
  /** Reports the shots that are read. */
  readFolder(files: ReadonlyMap<string, Blob>, shots: number | undefined): InputSummary;
  beginPictures(header: PicturesHeader): void;
  setDark(photograph: SentPicture): void;
  setCorrespondence(correspondence: Correspondence): void;
  addGrayCode(axis: 'x' | 'y', bit: number, inverted: boolean, photograph: SentPicture): void;
  addShot(index: number, pattern: SentPicture, photograph: SentPicture, exposure: number): void;
  finishPictures(): InputSummary;
  /** For `prepareWith` of a tile worker. */
  packInput(): Uint8Array;
  /** In a group with tile workers, which `prepareWith` it, or alone. Reports the jobs that are done. */
  prepare(settings: PreparationSettings, member: GroupMembership | null): PreparationSummary;
  /** For `unpack` of a tile worker. */
  pack(): Uint8Array;
  packRows(tileRow: number): PackedRows;
  recoverTile(tile: number): void;
  putTile(tile: number, record: Uint8Array): void;
  finish(): RecoverySummary;
  /** Reports the jobs that are done. */
  encode(quality: FileQuality | undefined): Uint8Array<ArrayBuffer>;
  photo(): TransferredPhoto;
  relight(light: Float32Array): Float32Array;
  transportFunction(x: number, y: number): TransportFunction;
  pointScatteringFunction(u: number, v: number): Float32Array;
  /** `undefined` after the last tile. */
  tileFunctions(index: number): TileFunctions | undefined;
  evaluatePair(
    index: number,
    light: SentPicture,
    photograph: SentPicture,
    exposure: number,
  ): PictureError;
  /** On the shots of the folder that were held out. */
  evaluateHeldOut(): PictureError;
}

export interface TileWorkerCalls {
  /** Prepares the recovery together with the coordinator; no need then to `unpack` and `setRows`. */
  prepareWith(packed: Uint8Array, settings: PreparationSettings, member: GroupMembership): void;
  unpack(packed: Uint8Array): void;
  setRows(rows: PackedRows): void;
  /** The tile's record, for `putTile` of the coordinator. */
  solveTile(tile: number): Uint8Array;
}

export type RecoveryCalls = CoordinatorCalls & TileWorkerCalls;

/** The methods of a worker that answers some of the calls, at once or later. */
export type Answers<Calls> = {
  [M in keyof Calls]: Calls[M] extends (...args: infer Args) => infer Result
    ? (...args: Args) => Result | Promise<Result>
    : never;
};

export interface RecoveryTask {
  readonly method: keyof RecoveryCalls;
  readonly args: readonly unknown[];
}

/** An error with a code. */
export interface SentError {
  readonly code: string;
  readonly message: string;
}

/** `stopped`: the module is unusable from now on. */
export type RecoveryResult =
  | { readonly value: unknown }
  | { readonly error: SentError; readonly stopped: boolean };

/** A worker starts with the error of its module, if that did not start. */
export type RecoveryWorker = WorkerLike<RecoveryTask, SentError | null, RecoveryResult>;
export type RecoveryWorkerClient = WorkerClient<RecoveryTask, SentError | null, RecoveryResult>;
