/** Decodes on the page's thread, in slices between which the page can draw. */

import type { Decoder, DecoderModule } from '../engine/wasm-exports.js';
import { completenessOf, type DecoderProgress, type PhotoDecoder } from './photo-decoder.js';
import { LoadedPhotograph } from './photograph.js';

/** Bytes decoded at once: so few that hardly more than one tile is completed by them. */
const SLICE_BYTES = 1 << 10;
/** Decoding time between two yields: half a frame at 60 Hz. */
const YIELD_INTERVAL_MS = 8;

/** `now` gives milliseconds, from any start. */
export function createMainThreadDecoder(
  { Decoder }: Pick<DecoderModule, 'Decoder'>,
  now: () => number,
  maxTileBytes?: number,
): PhotoDecoder {
  const decoder = new Decoder(undefined, maxTileBytes);
  let hasEnded = false;
  let lastYieldMs = now();
  return {
    get state() {
      return decoderState(decoder);
    },
    async feed(offset, bytes, yieldToPage) {
      for (let start = 0; start < bytes.byteLength; start += SLICE_BYTES) {
        decoder.feed(offset + start, bytes.subarray(start, start + SLICE_BYTES));
        if (now() - lastYieldMs < YIELD_INTERVAL_MS) continue;
        await yieldToPage();
        lastYieldMs = now();
      }
    },
    async preview() {
      const photo = decoder.preview();
      const completeness = completenessOf(decoderState(decoder));
      return photo ? LoadedPhotograph.fromModule(photo, decoder.levels(), completeness) : null;
    },
    async finish() {
      hasEnded = true;
      const levels = decoder.levels();
      return LoadedPhotograph.fromModule(decoder.finish(), levels);
    },
    free() {
      if (!hasEnded) decoder.free();
      hasEnded = true;
    },
  };
}

/** The state of a module's decoder. */
export function decoderState(decoder: Decoder): DecoderProgress {
  const [start = 0, end] = decoder.wants();
  const next = end === undefined ? undefined : { start, end };
  const { bytesFed, fileBytes, bytesOfLevels, scansDone } = decoder;
  return { bytesFed, fileBytes, bytesOfLevels, scansDone, next };
}
