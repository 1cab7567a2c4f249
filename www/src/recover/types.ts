/** The types of `relightable-photo/recover`. */

import type { PhotographSource } from '../photo/types.js';

/** `learned` is the most accurate; `nnls` and `bpdn` are those of the paper. */
export type RecoveryMethod = 'learned' | 'nnls' | 'bpdn';
export type SparsityBasis = 'identity' | 'dct' | 'haar';

/** A linear picture, row by row: red, green and blue, or, for patterns, one value for each light element. */
export interface LinearPicture {
  readonly width: number;
  readonly height: number;
  /** Photographs: 1 at full scale, NaN where a sample is saturated. Patterns: emission, 0 to 1. */
  readonly data: Float32Array;
}

/**
 * A photograph. `ImageData`, `ImageBitmap` and canvases hold 8-bit sRGB, which is made linear; 255 counts as saturated.
 * A `Blob`, an `ArrayBuffer` and a `Uint8Array` are a 16-bit linear RGB PNG.
 */
export type PhotographInput =
  | ImageData
  | ImageBitmap
  | HTMLCanvasElement
  | OffscreenCanvas
  | Blob
  | ArrayBuffer
  | Uint8Array
  | LinearPicture;

/** A pattern. The codes of 8-bit pictures and PNGs are made linear by `lightGamma`. */
export type PatternInput = PhotographInput;

export interface GrayCodePhotograph {
  readonly axis: 'x' | 'y';
  /** 0 is the least significant. */
  readonly bit: number;
  readonly inverted: boolean;
  readonly photograph: PhotographInput;
}

/** The map from camera pixels to light elements: rows for u and v, each times (x + ½, y + ½, 1). */
export type Correspondence = readonly [
  readonly [number, number, number],
  readonly [number, number, number],
];

/** Patterns and photographs that the page has, with either `correspondence` or `grayCode`. */
export interface PicturesInput {
  readonly patterns: readonly PatternInput[];
  readonly photographs: readonly PhotographInput[];
  /** Relative exposure of each photograph; 1 by default. */
  readonly exposures?: readonly number[];
  readonly correspondence?: Correspondence;
  readonly grayCode?: readonly GrayCodePhotograph[];
  /** The photograph under no light, which is subtracted from the others. */
  readonly dark?: PhotographInput;
  /** The emission of a code of a pattern is (code / 255) to this power; 2.2 by default. */
  readonly lightGamma?: number;
  /** Codes of 16-bit photographs without light and at full scale; 0 and 65535 by default. */
  readonly black?: number;
  readonly white?: number;
  /** Copied into the file, as are the next two. */
  readonly title?: string;
  readonly creator?: string;
  readonly rights?: string;
}

/** A capture folder, as `ltm-export` reads it: its files by their paths, relative to the folder. */
export interface FolderInput {
  readonly folder: ReadonlyMap<string, Blob>;
  /** Recovers from the first so many shots; by default from all but every tenth, which are held out. */
  readonly shots?: number;
}

/** SNR in decibels relative to the recovered transport, the most bytes, or eleven bits of every value. */
export type FileQuality = { readonly snr: number } | { readonly maxBytes: number } | 'lossless';

export interface RecoverySettings {
  /** `learned` by default. */
  readonly method?: RecoveryMethod;
  /** Of `bpdn`; `identity` by default. */
  readonly basis?: SparsityBasis;
  /** Side of the window in light elements, an odd number, or `auto`; 15 by default. */
  readonly window?: number | 'auto';
  /** Of the file; by default as much as the noise of the photographs justifies. */
  readonly quality?: FileQuality;
}

export type RecoveryStage = 'reading' | 'preparing' | 'recovering' | 'encoding';

export interface RecoveryProgress {
  readonly stage: RecoveryStage;
  /** Of the whole call, 0 to 1. */
  readonly fraction: number;
  /** Estimated; `undefined` while unknown. */
  readonly secondsLeft: number | undefined;
}

export interface ProgressOptions {
  /** Ends the call, which rejects with the signal's reason. */
  readonly signal?: AbortSignal;
  readonly onProgress?: (progress: RecoveryProgress) => void;
}

export interface RecoverOptions extends ProgressOptions {
  /** At most so many workers; by default one for each core, at most 4. */
  readonly workers?: number;
  /** Bytes that all workers may take; by default 1 GiB, less on devices with little memory. */
  readonly memoryLimit?: number;
  /** Folder of the WebAssembly modules; by default the one beside the script. */
  readonly wasmUrl?: string | URL;
}

/** The size of a recovery. */
export interface RecoverySize {
  readonly width: number;
  readonly height: number;
  readonly lightWidth: number;
  readonly lightHeight: number;
  readonly photographs: number;
}

export interface RecoveryEstimate {
  readonly memoryBytes: number;
  readonly seconds: number;
}

/** A doubt about the result, with a message in English that says what to check. */
export interface RecoveryWarning {
  readonly code: RecoveryWarningCode;
  readonly message: string;
}

export type RecoveryWarningCode =
  | 'low-snr'
  | 'band-unbounded'
  | 'band-undetermined'
  | 'saturation'
  | 'overexposed'
  | 'unknown-fields'
  | 'camera-trembled'
  | PhotographFaultCode;

/** Why a photograph is left out. */
export type PhotographFaultCode =
  | 'photograph-pattern'
  | 'photograph-blend'
  | 'photograph-unknown-pattern'
  | 'photograph-object'
  | 'photograph-moved'
  | 'photograph-distorted';

export interface EvaluationPair {
  readonly light: PatternInput;
  readonly photograph: PhotographInput;
  /** Relative exposure of the photograph; 1 by default. */
  readonly exposure?: number;
}

export interface TransportFunction {
  /** Column and row of the light element of the first value; they may lie off the light plane. */
  readonly origin: readonly [u: number, v: number];
  /** Red, green and blue of each element of the window, row by row. */
  readonly values: Float32Array;
}

/** The light transport functions of a rectangle of camera pixels. */
export interface TileFunctions {
  /** Column and row of the first pixel. */
  readonly x: number;
  readonly y: number;
  readonly width: number;
  readonly height: number;
  /** Red, green and blue of each element of each pixel's window; pixels and elements row by row. */
  readonly values: Float32Array;
}

/** A recovered photograph. It holds a worker and memory until it is freed. */
export interface RecoveredPhotograph extends PhotographSource {
  readonly width: number;
  readonly height: number;
  readonly lightWidth: number;
  readonly lightHeight: number;
  /** Side of the window, in light elements. */
  readonly window: number;
  /** Number of basis functions; `undefined` if the photograph has none. */
  readonly rank: number | undefined;
  /** SNR of the recovered transport in decibels, estimated on held-out patterns. */
  readonly expectedSnr: number | undefined;
  readonly correspondence: Correspondence;
  /** Indices of the shots that were recovered from. */
  readonly shotsUsed: readonly number[];
  readonly warnings: readonly RecoveryWarning[];
  /** How long the recovery took. */
  readonly seconds: number;
  /**
   * The `.ltm` file. Once `signal` is aborted, this rejects; the worker encodes to the end before it does anything else.
   */
  toBlob(quality?: FileQuality, options?: ProgressOptions): Promise<Blob>;
  /**
   * SNR in decibels of the pictures under the lights, over all pairs: infinite if they are the photographs, `undefined`
   * if those are black. The dark photograph is subtracted.
   */
  evaluate(pairs: readonly EvaluationPair[]): Promise<number | undefined>;
  /** SNR in decibels on the shots of the folder that were held out; `undefined` without any. */
  evaluateHeldOut(): Promise<number | undefined>;
  /** Linear RGB of the picture under linear RGB of each light element. */
  relight(light: Float32Array): Promise<Float32Array>;
  /** The light transport function of a camera pixel. */
  transportFunction(x: number, y: number): Promise<TransportFunction>;
  /** Linear RGB of the picture when the light element in column u and row v alone is on. */
  pointScatteringFunction(u: number, v: number): Promise<Float32Array>;
  /** The light transport functions of a tile; `undefined` after the last. */
  tileFunctions(index: number): Promise<TileFunctions | undefined>;
  /** Ends its worker and frees its memory. Elements that show it keep their copies. */
  free(): void;
}
