/** The tasks of a relighting worker and their results. */

import type { OutputSettings } from '../../engine/output-settings.js';
import type { Gamut } from '../../engine/wasm-exports.js';
import type { PhotoDescriptor } from '../../photo/types.js';
import type { ColorMatrix, PixelRect } from '../../shared/value-types.js';
import type { WorkerClient, WorkerLike } from '../../shared/worker-client.js';

export interface FrameSettings {
  readonly output: OutputSettings;
  readonly colorMatrix: ColorMatrix;
  readonly gamut: Gamut;
  /** Share of the components, 0 to 1. */
  readonly quality: number;
  /** The pixels of the picture that are drawn. */
  readonly view: PixelRect;
}

/** Camera rows of a photograph, made of whole rows of tiles. */
export interface RowRange {
  readonly firstRow: number;
  readonly rows: number;
}

/** What a worker does with the row range that it has of a photograph. */
export type RowRangeCommand =
  /** Allocates the row range. Its tiles follow. */
  | ({ readonly kind: 'open' } & Pick<PhotoDescriptor, 'geometry' | 'basis'> & RowRange)
  | { readonly kind: 'put'; readonly index: number; readonly bytes: Uint8Array<ArrayBuffer> }
  /** Gives a tile back: the result is its bytes. */
  | { readonly kind: 'take'; readonly index: number }
  /** Prepares relighting. The result is two `Uint32`: the first light row needed, and the end of those rows. */
  | { readonly kind: 'plan' }
  /** Relights. The result is `pixels`, filled with RGBA row by row in view. */
  | {
      readonly kind: 'relight';
      /** Linear R, G and B of the light rows needed; `null` for those of the last frame. */
      readonly light: Float32Array | null;
      readonly settings: FrameSettings;
      readonly pixels: ArrayBuffer;
    }
  | { readonly kind: 'close' };

export interface RelightWorkerTask {
  readonly photo: number;
  readonly task: RowRangeCommand;
}

/** `Ready` is the kernel's name, `Result` the bytes that the task asks for. */
export type RelightWorker = WorkerLike<RelightWorkerTask, string, ArrayBuffer>;
export type RelightClient = WorkerClient<RelightWorkerTask, string, ArrayBuffer>;
