/** Loads the modules of the core. The calls are pure, so that bundlers drop the module that a script does not use. */

import type { CpuModule, DecoderModule } from './wasm-exports.js';
import { cpu, cpu_scalar, decoder, decoder_scalar } from './wasm-hashes.js';
import { createLoader } from './wasm-loader.js';

export const loadDecoder = /* @__PURE__ */ createLoader<DecoderModule>(
  'decoder',
  'decodes photographs',
  {
    glue: () => import('./wasm/decoder.js'),
    simd: () => new URL('./wasm/decoder_bg.wasm', import.meta.url),
    scalar: () => new URL('./wasm/decoder_scalar_bg.wasm', import.meta.url),
    integrity: [decoder, decoder_scalar],
  },
);

export const loadCpu = /* @__PURE__ */ createLoader<CpuModule>('cpu', 'relights on the CPU', {
  glue: () => import('./wasm/cpu.js'),
  simd: () => new URL('./wasm/cpu_bg.wasm', import.meta.url),
  scalar: () => new URL('./wasm/cpu_scalar_bg.wasm', import.meta.url),
  integrity: [cpu, cpu_scalar],
});
