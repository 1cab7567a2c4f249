/** Decodes and relights without the element: in Node, in workers and in pages. No DOM, no side effects. */

export type { CorePhotograph as Photograph } from './core/core-photograph.js';
export { type DecodeInput, type DecodeOptions, decode } from './core/decode.js';
export {
  type LightDescriptor as Light,
  type LightImage,
  type RelightOptions,
  type RelitPicture,
  relight,
  type Torch,
} from './core/relight.js';
export { type CoreModuleName, provideWasm, type WasmInput } from './core/wasm-provider.js';
export { type ErrorCode, PhotoError } from './shared/errors.js';
export { type Gamut, LIGHTS, type LightName, type ToneCurve } from './shared/keywords.js';
