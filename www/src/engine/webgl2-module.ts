/** Loads the WebGL2 backend's module. */

import type { WebGl2Module } from './types.js';
import { createLoader } from './wasm-loader.js';

export const loadWebGl2 = createLoader<WebGl2Module>('webgl2', 'relights with WebGL2', {
  glue: () => import('./wasm/webgl2.js'),
  simd: () => new URL('./wasm/webgl2_bg.wasm', import.meta.url),
});
