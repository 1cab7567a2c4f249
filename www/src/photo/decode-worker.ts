/** The script of the worker that decodes one photograph. */

import { loadDecoder } from '../engine/core-modules.js';
import type { DecodedPhoto, Decoder } from '../engine/wasm-exports.js';
import { serve } from '../engine/worker-server.js';
import { toPhotoError } from '../shared/errors.js';
import { decoderState } from './main-thread-decoder.js';
import { describePhoto, type TransferredTile } from './types.js';
import type { DecodeResult, DecodeTask, TransferredPhoto } from './worker-decoder.js';

function answer(decoder: Decoder, task: DecodeTask): DecodeResult {
  try {
    if (task.kind === 'feed') {
      decoder.feed(task.offset, task.bytes);
      return { state: decoderState(decoder) };
    }
    const photo = task.kind === 'finish' ? decoder.finish() : decoder.preview();
    return { photo: photo ? takeOut(photo) : null };
  } catch (thrown) {
    const { code, message } = toPhotoError(thrown);
    return { error: { code, message } };
  }
}

/** Moves a photograph out of the module's memory. */
function takeOut(photo: DecodedPhoto): TransferredPhoto {
  const descriptor = describePhoto(photo);
  const takeTile = (_: unknown, index: number) => photo.takeTile(index) as TransferredTile;
  const tiles = Array.from({ length: descriptor.tiles }, takeTile);
  photo.free();
  return { descriptor, tiles };
}

serve(async () => {
  const { Decoder } = await loadDecoder();
  const decoder = new Decoder();
  return {
    ready: decoderState(decoder),
    handle: (task: DecodeTask) => {
      const result = answer(decoder, task);
      const tiles = 'photo' in result ? result.photo?.tiles : undefined;
      return [result, tiles?.map(({ buffer }) => buffer) ?? []] as const;
    },
  };
});
