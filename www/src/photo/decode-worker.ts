/** The script of a worker that decodes one photograph after another. */

import { loadDecoder } from '../engine/core-modules.js';
import type { Decoder, DecoderModule } from '../engine/wasm-exports.js';
import { serve } from '../engine/worker-server.js';
import { toPhotoError } from '../shared/errors.js';
import { decoderState } from './main-thread-decoder.js';
import { takeOut } from './types.js';
import type { DecodeResult, DecodeTask } from './worker-decoder.js';

/** Ended by `finish`. */
let decoder: Decoder | null = null;

function answer(
  { Decoder }: DecoderModule,
  memory: Pick<WebAssembly.Memory, 'buffer'>,
  task: DecodeTask,
): DecodeResult {
  try {
    if (task.kind === 'open') {
      decoder?.free();
      decoder = new Decoder(undefined, task.maxTileBytes);
      return { state: decoderState(decoder) };
    }
    if (!decoder) throw new Error('No file was opened.');
    if (task.kind === 'feed') {
      decoder.feed(task.offset, task.bytes);
      return { state: decoderState(decoder) };
    }
    const current = decoder;
    if (task.kind === 'finish') decoder = null;
    const levels = current.levels();
    const photo = task.kind === 'finish' ? current.finish() : current.preview();
    return { photo: photo ? takeOut(photo, levels) : null, memoryBytes: memory.buffer.byteLength };
  } catch (thrown) {
    const { code, message } = toPhotoError(thrown);
    return { error: { code, message } };
  }
}

serve(async () => {
  const module = await loadDecoder();
  const { memory } = await module.default();
  return {
    ready: null,
    handle: (task: DecodeTask) => {
      const result = answer(module, memory, task);
      const tiles = 'photo' in result ? result.photo?.tiles : undefined;
      return [result, tiles?.map(({ buffer }) => buffer) ?? []] as const;
    },
  };
});
