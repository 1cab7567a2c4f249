/** Decoding and relighting without a page: for Node, workers and scripts of one's own. No DOM, no side effects. */

export type { CorePhotograph as Photograph, DecodeOptions, PhotoFile } from './core/decode.js';
export { decode } from './core/decode.js';
export type {
  CoreLight as Light,
  Picture,
  PictureLight,
  RelightOptions,
  Torch,
} from './core/relight.js';
export { relight } from './core/relight.js';
export type { WasmCode } from './core/wasm-code.js';
export type { EngineErrorCode, ErrorCode, PageErrorCode } from './shared/errors.js';
export { PhotoError } from './shared/errors.js';
export type { Gamut, LightName, ToneCurve } from './shared/names.js';
export { LIGHTS } from './shared/names.js';

import { provideCode, type WasmCode } from './core/wasm-code.js';
import { CORE_MODULES } from './shared/names.js';

/** A WebAssembly module, by name. */
export type ModuleName = (typeof CORE_MODULES)[number];

/**
 * Has modules started from these bytes, or from these addresses, in place of the files
 * beside the script: for where those can be neither fetched nor read. To be called before the first
 * `decode`. Code with SIMD is for machines that have it.
 */
export function provideWasm(codes: Readonly<Partial<Record<ModuleName, WasmCode>>>): void {
  for (const [name, code] of Object.entries(codes)) {
    const module = CORE_MODULES.find((known) => known === name);
    if (module === undefined) {
      throw new TypeError(
        `There is no module named “${name}”. Known modules: ${CORE_MODULES.join(', ')}.`,
      );
    }
    if (code !== undefined) provideCode(module, code);
  }
}
