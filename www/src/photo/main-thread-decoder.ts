/** Decodes on the page's thread, in slices between which the page can draw. */

import type { Decoder, DecoderModule } from '../engine/types.js';
import {
  completenessOf,
  type DecoderState,
  type PhotoDecoder,
  type YieldToPage,
} from './photo-decoder.js';
import { Photograph } from './photograph.js';

/** Bytes decoded at once: so few that hardly more than one tile is completed by them. */
const SLICE_BYTES = 1 << 10;
/** Decoding time between two yields: half a frame at 60 Hz. */
const YIELD_INTERVAL_MS = 8;

export class MainThreadDecoder implements PhotoDecoder {
  readonly #decoder: Decoder;
  readonly #now: () => number;
  #hasEnded = false;
  #lastYieldMs: number;

  /** `now` gives milliseconds, from any start. */
  constructor(module: DecoderModule, now: () => number) {
    this.#decoder = new module.Decoder();
    this.#now = now;
    this.#lastYieldMs = now();
  }

  get state(): DecoderState {
    return decoderState(this.#decoder);
  }

  async feed(offset: number, bytes: Uint8Array, yieldToPage: YieldToPage): Promise<void> {
    for (let start = 0; start < bytes.byteLength; start += SLICE_BYTES) {
      this.#decoder.feed(offset + start, bytes.subarray(start, start + SLICE_BYTES));
      if (this.#now() - this.#lastYieldMs < YIELD_INTERVAL_MS) continue;
      await yieldToPage();
      this.#lastYieldMs = this.#now();
    }
  }

  async preview(): Promise<Photograph | null> {
    const photo = this.#decoder.preview();
    return photo ? Photograph.fromModule(photo, completenessOf(this.state)) : null;
  }

  async finish(): Promise<Photograph> {
    this.#hasEnded = true;
    return Photograph.fromModule(this.#decoder.finish());
  }

  free(): void {
    if (!this.#hasEnded) this.#decoder.free();
    this.#hasEnded = true;
  }
}

/** The state of a module's decoder. */
export function decoderState(decoder: Decoder): DecoderState {
  const [start = 0, end] = decoder.wants();
  const next = end === undefined ? undefined : { start, end };
  const { bytesFed, fileBytes, scansDone } = decoder;
  return { bytesFed, fileBytes, scansDone, next };
}
