/** What the page and a worker that relights say to each other: one answer to each request. */

import type { OutputSettings } from '../../engine/output-settings.js';
import type { Gamut } from '../../engine/types.js';

/** How a picture is drawn. */
export interface Showing {
  readonly output: OutputSettings;
  /** Of the canvas. */
  readonly gamut: Gamut;
  /** Share of the components, 0 to 1. */
  readonly detail: number;
}

/** What a worker is asked to do with rows of a photograph. */
export type Task =
  /** Make room for them; their tiles are to follow. */
  | {
      readonly kind: 'open';
      readonly geometry: Float64Array;
      readonly basis: Float32Array;
      readonly firstRow: number;
      readonly rows: number;
    }
  /** Keep a tile. */
  | { readonly kind: 'put'; readonly index: number; readonly bytes: Uint8Array<ArrayBuffer> }
  /** Give a tile back. The answer has its bytes. */
  | { readonly kind: 'take'; readonly index: number }
  /** Get ready to relight them. The answer tells which rows of the light they see: two `Uint32`. */
  | { readonly kind: 'plan' }
  /** Relight them. The answer has their pixels, RGBA row by row, in the same memory. */
  | {
      readonly kind: 'relight';
      /** Linear R, G and B of the rows that are seen; `null` for those of the last time. */
      readonly light: Float32Array | null;
      readonly showing: Showing;
      readonly pixels: ArrayBuffer;
    }
  /** Let them go. */
  | { readonly kind: 'close' };

/** A task. */
export interface Request {
  /** Of the request; its answer has the same. */
  readonly number: number;
  /** Of the photograph. */
  readonly photo: number;
  readonly task: Task;
}

/** What a worker says. */
export type Answer =
  /** It can be asked. `kernel` is what does the work. */
  | { readonly kind: 'ready'; readonly kernel: string }
  | { readonly kind: 'done'; readonly number: number; readonly bytes: ArrayBuffer }
  /** The worker could not start, or do what it was asked; nobody knows what became of its tiles. */
  | { readonly kind: 'broken'; readonly message: string };
