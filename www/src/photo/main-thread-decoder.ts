/** Decoding on the page's own thread, in turns. */

import type { Decoder, DecoderModule } from '../engine/types.js';
import type { ByteRange } from '../shared/byte-range.js';
import { Photograph } from './photograph.js';

/** How far decoding has come, and what is to be fed to it. */
export interface DecoderState {
  /** Each byte counted once. */
  readonly bytesFed: number;
  readonly fileBytes: number | undefined;
  /** Scans that are there for every tile. */
  readonly scansDone: number;
  /** What matters most of what is missing. Of a file that comes in order that is all that is left of it, or
   * of its head. Undefined once all has come. */
  readonly next: ByteRange | undefined;
}

/** Lets the page draw and take input. Throws once nobody waits for the photograph any more. */
export type Turn = () => Promise<void>;

/** Takes a file's bytes and makes a photograph of them, on whichever thread. */
export interface PhotoDecoder {
  readonly state: DecoderState;
  /** Takes the file's bytes from `offset` on; those of a range in order. */
  feed(offset: number, bytes: Uint8Array, turn: Turn): Promise<void>;
  /** A coarser photograph of what has come, if there is one. */
  preview(): Promise<Photograph | null>;
  /** Ends the decoder, whether it succeeds or throws. */
  finish(): Promise<Photograph>;
  /** Ends the decoder, if it has not ended. What `finish` is at is not waited for. */
  free(): void;
}

/** Bytes decoded in one go: so few that hardly two tiles end among them. */
const SLICE_BYTES = 1 << 10;
/** Time after which the page gets its turn: within a frame of 60 a second, with room for its own
 * work. */
const TURN_MS = 8;

/** See the module. */
export class MainThreadDecoder implements PhotoDecoder {
  readonly #decoder: Decoder;
  readonly #now: () => number;
  #ended = false;
  /** When the page had its last turn. */
  #turned: number;

  /** `now` tells milliseconds, from any start. */
  constructor(module: DecoderModule, now: () => number) {
    this.#decoder = new module.Decoder();
    this.#now = now;
    this.#turned = now();
  }

  get state(): DecoderState {
    return stateOf(this.#decoder);
  }

  async feed(offset: number, bytes: Uint8Array, turn: Turn): Promise<void> {
    for (let at = 0; at < bytes.byteLength; at += SLICE_BYTES) {
      this.#decoder.feed(offset + at, bytes.subarray(at, at + SLICE_BYTES));
      if (this.#now() - this.#turned < TURN_MS) continue;
      await turn();
      this.#turned = this.#now();
    }
  }

  async preview(): Promise<Photograph | null> {
    const photo = this.#decoder.preview();
    return photo ? Photograph.decoded(photo, shareOf(this.state)) : null;
  }

  async finish(): Promise<Photograph> {
    this.#ended = true;
    return Photograph.decoded(this.#decoder.finish());
  }

  free(): void {
    if (!this.#ended) this.#decoder.free();
    this.#ended = true;
  }
}

/** What a decoder of the module says of itself. */
export function stateOf(decoder: Decoder): DecoderState {
  const [start = 0, end] = decoder.wants();
  const next = end === undefined ? undefined : { start, end };
  const { bytesFed, fileBytes, scansDone } = decoder;
  return { bytesFed, fileBytes, scansDone, next };
}

/** How much of a file has come, 0 to 1. */
export function shareOf({ bytesFed, fileBytes }: DecoderState): number {
  return fileBytes ? Math.min(1, bytesFed / fileBytes) : 0;
}
