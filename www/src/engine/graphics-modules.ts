/** Loads the modules of the graphics backends, apart from the core's: bundlers keep the files that a script imports. */

import type { GraphicsModules } from './wasm-exports.js';
import { webgl2, webgpu } from './wasm-hashes.js';
import { createLoader } from './wasm-loader.js';

export const GRAPHICS_LOADERS: {
  readonly [N in keyof GraphicsModules]: () => Promise<GraphicsModules[N]>;
} = {
  webgl2: createLoader('webgl2', 'relights with WebGL2', {
    glue: () => import('./wasm/webgl2.js'),
    simd: () => new URL('./wasm/webgl2_bg.wasm', import.meta.url),
    integrity: [webgl2],
  }),
  webgpu: createLoader('webgpu', 'relights with WebGPU', {
    glue: () => import('./wasm/webgpu.js'),
    simd: () => new URL('./wasm/webgpu_bg.wasm', import.meta.url),
    integrity: [webgpu],
  }),
};
