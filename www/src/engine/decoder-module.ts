/** Loads the decoder's module. */

import type { DecoderModule } from './types.js';
import { createLoader } from './wasm-loader.js';

export const loadDecoder = createLoader<DecoderModule>('decoder', 'decodes photographs', {
  glue: () => import('./wasm/decoder.js'),
  simd: () => new URL('./wasm/decoder_bg.wasm', import.meta.url),
  scalar: () => new URL('./wasm/decoder_scalar_bg.wasm', import.meta.url),
});
