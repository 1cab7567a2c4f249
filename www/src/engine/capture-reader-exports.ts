/**
 * The exports of the WebAssembly module that reads captures. `tests/browser/engine-contract.ts` compares these types with
 * those of wasm-bindgen. All pictures are linear, row by row.
 */

import type { Freeable, ModuleExports } from './wasm-exports.js';

/** Files that a worker reads within a call. Names are relative to the capture folder. */
export interface PageFiles {
  /** Bytes of the file; `undefined` if there is no such file. */
  size(name: string): number | undefined;
  /** Throws if the browser cannot read the file. */
  read(name: string, offset: number, length: number): Uint8Array;
}

/** Reads the shots of a capture folder. */
export interface CaptureReader extends Freeable {
  /** Number of shots in the folder. */
  readonly shots: number;
  readonly unknownFields: string[];
  /** All that a recovery from the first `count` shots, or from all but those held out, needs beside the photographs. */
  calibration(count: number | undefined): Uint8Array;
  /** Three values for each pixel; NaN where it is saturated. */
  photograph(shot: number): Float32Array;
  /** Three values for each light element. */
  light(shot: number): Float32Array;
}

/** A PNG that is decoded. */
export interface LinearPng extends Freeable {
  readonly width: number;
  readonly height: number;
  /** Three values for each pixel of a photograph; one or three for each element of a pattern. */
  readonly data: Float32Array;
}

export interface CaptureReaderModule {
  default(): Promise<ModuleExports>;
  CaptureReader: { open(files: PageFiles): CaptureReader };
  readPhotograph(files: PageFiles, name: string, black: number, white: number): LinearPng;
  readPattern(files: PageFiles, name: string, gamma: number): LinearPng;
}
