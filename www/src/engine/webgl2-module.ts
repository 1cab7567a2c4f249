/** The module that relights by WebGL2. */

import type { WebGl2Module } from './types.js';
import { loader } from './wasm-loader.js';

/** Loads it, once a page. */
export const loadWebGl2 = loader<WebGl2Module>('webgl2', 'relights by WebGL2', {
  glue: () => import('./wasm/webgl2.js'),
  simd: () => new URL('./wasm/webgl2_bg.wasm', import.meta.url),
});
