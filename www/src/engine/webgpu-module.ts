/** Loads the WebGPU backend's module. */

import type { WebGpuModule } from './types.js';
import { createLoader } from './wasm-loader.js';

export const loadWebGpu = createLoader<WebGpuModule>('webgpu', 'relights with WebGPU', {
  glue: () => import('./wasm/webgpu.js'),
  simd: () => new URL('./wasm/webgpu_bg.wasm', import.meta.url),
});
