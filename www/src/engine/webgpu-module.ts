/** The module that relights by WebGPU. */

import type { WebGpuModule } from './types.js';
import { loader } from './wasm-loader.js';

/** Loads it, once a page. */
export const loadWebGpu = loader<WebGpuModule>('webgpu', 'relights by WebGPU', {
  glue: () => import('./wasm/webgpu.js'),
  simd: () => new URL('./wasm/webgpu_bg.wasm', import.meta.url),
});
