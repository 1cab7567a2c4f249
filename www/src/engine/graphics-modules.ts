/** Loads the modules of the graphics backends, apart from the core's: bundlers keep the files that a script imports. */

import type { WebGl2Module, WebGpuModule } from './types.js';
import { createLoader } from './wasm-loader.js';

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
