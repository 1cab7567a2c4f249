/** Loads the module that reads captures, without a build for machines without SIMD, as that of recovery. */

import type { CaptureReaderModule } from './capture-reader-exports.js';
import { capture_reader } from './wasm-hashes.js';
import { createLoader } from './wasm-loader.js';

export const loadCaptureReader = /* @__PURE__ */ createLoader<CaptureReaderModule>(
  'capture_reader',
  'reads photographs',
  {
    glue: () => import('./wasm/capture_reader.js'),
    simd: () => new URL('./wasm/capture_reader_bg.wasm', import.meta.url),
    integrity: [capture_reader],
  },
);
