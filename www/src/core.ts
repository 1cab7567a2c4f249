/** Decodes and relights without the element: in Node, in workers and in pages. No DOM, no side effects. */

export type { DecodeOptions, PhotoFile } from './core/decode.js';
export { decode } from './core/decode.js';
export type {
  CoreLight as Light,
  Picture,
  PictureLight,
  RelightOptions,
  Torch,
} from './core/relight.js';
export { relight } from './core/relight.js';
export type { CorePhotograph as Photograph } from './core/types.js';
export type { WasmCode } from './core/wasm-code.js';
export type { EngineErrorCode, ErrorCode, PageErrorCode } from './shared/errors.js';
export { PhotoError } from './shared/errors.js';
export type { Gamut, LightName, ToneCurve } from './shared/names.js';
export { LIGHTS } from './shared/names.js';

import { provideCode, type WasmCode } from './core/wasm-code.js';
import { CORE_MODULES } from './shared/names.js';

/** The name of a WebAssembly module. */
export type ModuleName = (typeof CORE_MODULES)[number];

/**
 * Sets the bytes or the addresses of WebAssembly modules, where the files beside the script can be neither fetched nor
 * read. Call it before the first `decode`. Code with SIMD needs a machine with SIMD.
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
