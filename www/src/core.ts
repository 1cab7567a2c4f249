/** Decodes and relights without the element: in Node, in workers and in pages. No DOM, no side effects. */

export { type DecodeOptions, decode, type LtmInput } from './core/decode.js';
export {
  type CoreLight as Light,
  type PictureLight,
  type RelightOptions,
  type RelitPicture,
  relight,
  type Torch,
} from './core/relight.js';
export type { CorePhotograph as Photograph } from './core/types.js';
export { type CoreModuleName, provideWasm, type WasmCode } from './core/wasm-code.js';
export {
  type EngineErrorCode,
  type ErrorCode,
  type PageErrorCode,
  PhotoError,
} from './shared/errors.js';
export { type Gamut, LIGHTS, type LightName, type ToneCurve } from './shared/names.js';
