/** Loads the WebAssembly modules. Each load is pure, so that bundlers drop those that a script does not use. */

import type { CpuModule, DecoderModule, WebGl2Module, WebGpuModule } from './types.js';
import { createLoader } from './wasm-loader.js';

export const loadDecoder = /* @__PURE__ */ createLoader<DecoderModule>(
  'decoder',
  'decodes photographs',
  {
    glue: () => import('./wasm/decoder.js'),
    simd: () => new URL('./wasm/decoder_bg.wasm', import.meta.url),
    scalar: () => new URL('./wasm/decoder_scalar_bg.wasm', import.meta.url),
  },
);

export const loadCpu = /* @__PURE__ */ createLoader<CpuModule>('cpu', 'relights on the CPU', {
  glue: () => import('./wasm/cpu.js'),
  simd: () => new URL('./wasm/cpu_bg.wasm', import.meta.url),
  scalar: () => new URL('./wasm/cpu_scalar_bg.wasm', import.meta.url),
});

export const loadWebGl2 = /* @__PURE__ */ createLoader<WebGl2Module>(
  'webgl2',
  'relights with WebGL2',
  {
    glue: () => import('./wasm/webgl2.js'),
    simd: () => new URL('./wasm/webgl2_bg.wasm', import.meta.url),
  },
);

export const loadWebGpu = /* @__PURE__ */ createLoader<WebGpuModule>(
  'webgpu',
  'relights with WebGPU',
  {
    glue: () => import('./wasm/webgpu.js'),
    simd: () => new URL('./wasm/webgpu_bg.wasm', import.meta.url),
  },
);
