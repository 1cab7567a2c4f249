/** Loads the module of recovery. It has no build for machines without SIMD, where a recovery would take minutes. */

import type { RecoveryModule } from './recovery-exports.js';
import { recovery } from './wasm-hashes.js';
import { createLoader } from './wasm-loader.js';

export const loadRecovery = /* @__PURE__ */ createLoader<RecoveryModule>(
  'recovery',
  'recovers photographs',
  {
    glue: () => import('./wasm/recovery.js'),
    simd: () => new URL('./wasm/recovery_bg.wasm', import.meta.url),
    integrity: [recovery],
  },
);
