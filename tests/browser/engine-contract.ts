/**
 * Checked by the compiler, never run: what wasm-bindgen generated is what the element was written
 * against. Needs pkg-scripts/build to have run.
 */

import type * as Simd from '../../dist/wasm/relightable_photo.js';
import type * as Scalar from '../../dist/wasm/relightable_photo_scalar.js';
import type { Backend, Decoder, Light, Photo, Relighter } from '../../www/src/engine.js';

// Its classes are nominal, so functions of one cannot be assigned to functions of the other; what
// they give and take can.
type Extends<A extends B, B> = A;

type _Builds = Extends<typeof Scalar, Pick<typeof Scalar, keyof typeof Simd>>;
type _Decoder = Extends<Simd.Decoder, Omit<Decoder, 'finish'>>;
type _Constructor = Extends<[number?], ConstructorParameters<typeof Simd.Decoder>>;
type _Finish = Extends<ReturnType<Simd.Decoder['finish']>, Photo>;
type _Receive = Extends<ReturnType<typeof Simd.Photo.receive>, Photo>;
type _Parcels = Extends<
  [Float64Array, Float32Array, string],
  Parameters<typeof Simd.Photo.receive>
>;
type _Light = Extends<ReturnType<typeof Simd.Light.builtin>, Light>;
type _Builtin = Extends<[Simd.Photo, string], Parameters<typeof Simd.Light.builtin>>;
type _Torch = Extends<[Simd.Photo, number, number, number?], Parameters<typeof Simd.Light.torch>>;
type _Create = Extends<
  [Backend, Simd.Photo, HTMLCanvasElement],
  Parameters<typeof Simd.Relighter.create>
>;
type _Relighter = Extends<
  Awaited<ReturnType<typeof Simd.Relighter.create>>,
  Omit<Relighter, 'render'>
>;
type _Render = Extends<[Simd.Light, number], Parameters<Simd.Relighter['render']>>;

export type Contract = [
  _Builds,
  _Decoder,
  _Constructor,
  _Finish,
  _Receive,
  _Parcels,
  _Light,
  _Builtin,
  _Torch,
  _Create,
  _Relighter,
  _Render,
];
