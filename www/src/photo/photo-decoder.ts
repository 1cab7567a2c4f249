/** The interface of the decoders, each of which decodes one file, on the page's thread or in a worker. */

import type { Decoder } from '../engine/wasm-exports.js';
import type { ByteRange } from '../shared/value-types.js';
import type { LoadedPhotograph } from './photograph.js';

export interface DecoderProgress
  extends Pick<Decoder, 'bytesFed' | 'fileBytes' | 'bytesOfLevels' | 'scansDone'> {
  /** The range to feed next; `undefined` once the file is complete. */
  readonly next: ByteRange | undefined;
}

export interface PhotoDecoder {
  readonly state: DecoderProgress;
  /** As `Decoder.feed`. `yieldToPage` lets the page draw; it throws if the load was cancelled meanwhile. */
  feed(offset: number, bytes: Uint8Array, yieldToPage: () => Promise<void>): Promise<void>;
  /** A coarser photograph from the bytes so far; `null` if they do not suffice. */
  preview(): Promise<LoadedPhotograph | null>;
  /** The photograph. Ends the decoder, also if it rejects. */
  finish(): Promise<LoadedPhotograph>;
  /** Ends the decoder at once, even in the middle of a task. Does nothing if it has ended. */
  free(): void;
}

/** The share of a file that was fed, 0 to 1. */
export function completenessOf({ bytesFed, fileBytes }: DecoderProgress): number {
  return fileBytes ? Math.min(1, bytesFed / fileBytes) : 0;
}
