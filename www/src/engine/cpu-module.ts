/** The module that relights on the CPU. */

import type { CpuModule } from './types.js';
import { loader } from './wasm-loader.js';

/** Loads it, once a page. */
export const loadCpu = loader<CpuModule>('cpu', 'relights on the CPU', {
  glue: () => import('./wasm/cpu.js'),
  simd: () => new URL('./wasm/cpu_bg.wasm', import.meta.url),
  scalar: () => new URL('./wasm/cpu_scalar_bg.wasm', import.meta.url),
});
