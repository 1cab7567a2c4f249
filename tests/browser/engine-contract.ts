/**
 * Checked by the compiler, never run: what wasm-bindgen generated is what the element was written
 * against. Needs pkg-scripts/build to have run.
 */

import type * as Simd from '../../dist/wasm/relightable_photo.js';
import type {
  BandRelighter,
  Decoder,
  Display,
  Engine,
  Gamut,
  Graphics,
  Light,
  Photo,
  Relighter,
} from '../../www/src/engine.js';

// Its classes are nominal, so functions of one cannot be assigned to functions of the other; what
// they give and take can.
type Extends<A extends B, B> = A;

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
type _Linear = Extends<
  [Simd.Photo, Float32Array, number, number],
  Parameters<typeof Simd.Light.fromLinear>
>;
type _Srgb = Extends<
  [Simd.Photo, Uint8ClampedArray, number, number],
  Parameters<typeof Simd.Light.fromSrgb>
>;
type _Display = Extends<Simd.Display, Display>;
type _DisplayOf = Extends<
  ConstructorParameters<Engine['Display']>,
  ConstructorParameters<typeof Simd.Display>
>;
type _Band = Extends<Simd.BandRelighter, Omit<BandRelighter, 'relight'>>;
type _BandOf = Extends<
  [Simd.Photo, number, number],
  ConstructorParameters<typeof Simd.BandRelighter>
>;
type _BandRelight = Extends<
  [Float32Array | null, Simd.Display, number, Uint8Array],
  Parameters<Simd.BandRelighter['relight']>
>;
type _Kernel = Extends<typeof Simd.cpuKernel, Engine['cpuKernel']>;
type _Graphics = Extends<Simd.Graphics, Omit<Graphics, 'draw'>>;
type _WebGpu = Extends<ReturnType<typeof Simd.Graphics.webgpu>, Promise<Simd.Graphics>>;
type _WebGl2 = Extends<[HTMLCanvasElement], Parameters<typeof Simd.Graphics.webgl2>>;
type _Draw = Extends<[Simd.Photo, HTMLCanvasElement, Gamut], Parameters<Simd.Graphics['draw']>>;
type _Drawn = Extends<ReturnType<Simd.Graphics['draw']>, Promise<Simd.Relighter>>;
type _Relighter = Extends<Simd.Relighter, Omit<Relighter, 'render' | 'renderPicture'>>;
type _RenderPicture = Extends<[Simd.Display, number], Parameters<Simd.Relighter['renderPicture']>>;
type _RelighterOf = Extends<
  [Simd.Photo, HTMLCanvasElement, Gamut],
  ConstructorParameters<typeof Simd.Relighter>
>;
type _Render = Extends<[Simd.Light, Simd.Display, number], Parameters<Simd.Relighter['render']>>;

export type Contract = [
  _Decoder,
  _Constructor,
  _Finish,
  _Receive,
  _Parcels,
  _Light,
  _Builtin,
  _Torch,
  _Display,
  _DisplayOf,
  _Linear,
  _Srgb,
  _Band,
  _BandOf,
  _BandRelight,
  _Kernel,
  _Graphics,
  _WebGpu,
  _WebGl2,
  _Draw,
  _Drawn,
  _Relighter,
  _RelighterOf,
  _Render,
  _RenderPicture,
];
