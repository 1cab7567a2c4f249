/** The module that decodes photographs. */

import type { DecoderModule } from './types.js';
import { loader } from './wasm-loader.js';

/** Loads it, once a page. */
export const loadDecoder = loader<DecoderModule>('decoder', 'decodes photographs', {
  glue: () => import('./wasm/decoder.js'),
  simd: () => new URL('./wasm/decoder_bg.wasm', import.meta.url),
  scalar: () => new URL('./wasm/decoder_scalar_bg.wasm', import.meta.url),
});
