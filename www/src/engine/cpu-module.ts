/** Loads the CPU backend's module. */

import type { CpuModule } from './types.js';
import { createLoader } from './wasm-loader.js';

export const loadCpu = createLoader<CpuModule>('cpu', 'relights on the CPU', {
  glue: () => import('./wasm/cpu.js'),
  simd: () => new URL('./wasm/cpu_bg.wasm', import.meta.url),
  scalar: () => new URL('./wasm/cpu_scalar_bg.wasm', import.meta.url),
});
