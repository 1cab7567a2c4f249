/**
 * Checked by the compiler, never run: what wasm-bindgen generated is what the element was written
 * against. Needs pkg-scripts/build to have run.
 */

import type * as CaptureReaders from '../../dist/wasm/capture_reader.js';
import type * as Cpu from '../../dist/wasm/cpu.js';
import type * as Decoders from '../../dist/wasm/decoder.js';
import type * as Recoveries from '../../dist/wasm/recovery.js';
import type * as WebGl2 from '../../dist/wasm/webgl2.js';
import type * as WebGpu from '../../dist/wasm/webgpu.js';
import type {
  CaptureReader,
  CaptureReaderModule,
  LinearPng,
} from '../../www/src/engine/capture-reader-exports.js';
import type {
  CaptureBuilder,
  MeasurementBuilder,
  MeasurementInput,
  RecoveredTransport,
  Recovery,
  RecoveryModule,
  TileRecovery,
} from '../../www/src/engine/recovery-exports.js';
import type {
  CanvasRelighter,
  DecodedPhoto,
  Decoder,
  Gamut,
  GraphicsDevice,
  ImportedPhoto,
  Light,
  OutputTransform,
  RelightModule,
  RowRangeRelighter,
} from '../../www/src/engine/wasm-exports.js';

// Its classes are nominal, so functions of one cannot be assigned to functions of the other; what
// they give and take can.
type Extends<A extends B, B> = A;

type _Decoder = Extends<Decoders.Decoder, Omit<Decoder, 'finish' | 'preview'>>;
type _Constructor = Extends<[number?], ConstructorParameters<typeof Decoders.Decoder>>;
type _Finish = Extends<ReturnType<Decoders.Decoder['finish']>, DecodedPhoto>;
type _Preview = Extends<ReturnType<Decoders.Decoder['preview']>, DecodedPhoto | undefined>;

type _CpuReceive = Extends<ReturnType<typeof Cpu.Photo.receive>, ImportedPhoto>;
type _CpuDescriptor = Extends<[Float64Array, Float32Array], Parameters<typeof Cpu.Photo.receive>>;
type _CpuLight = Extends<ReturnType<typeof Cpu.Light.builtin>, Light>;
type _CpuBuiltin = Extends<[Cpu.Photo, string], Parameters<typeof Cpu.Light.builtin>>;
type _CpuTorch = Extends<[Cpu.Photo, number, number, number?], Parameters<typeof Cpu.Light.torch>>;
type _CpuLinear = Extends<
  [Cpu.Photo, Float32Array, number, number],
  Parameters<typeof Cpu.Light.fromLinear>
>;
type _CpuSrgb = Extends<
  [Cpu.Photo, Uint8ClampedArray, number, number],
  Parameters<typeof Cpu.Light.fromSrgb>
>;
type _CpuOutputTransform = Extends<Cpu.OutputTransform, OutputTransform>;
type _CpuOutputTransformOf = Extends<
  ConstructorParameters<RelightModule['OutputTransform']>,
  ConstructorParameters<typeof Cpu.OutputTransform>
>;
type _CpuRelighter = Extends<
  Cpu.CanvasRelighter,
  Omit<CanvasRelighter, 'render' | 'renderLightImage'>
>;
type _CpuRender = Extends<
  [Cpu.Light, Cpu.OutputTransform, number],
  Parameters<Cpu.CanvasRelighter['render']>
>;
type _CpuRenderPicture = Extends<
  [Cpu.OutputTransform, number],
  Parameters<Cpu.CanvasRelighter['renderLightImage']>
>;

type _WebGl2Receive = Extends<ReturnType<typeof WebGl2.Photo.receive>, ImportedPhoto>;
type _WebGl2Parcels = Extends<
  [Float64Array, Float32Array],
  Parameters<typeof WebGl2.Photo.receive>
>;
type _WebGl2Light = Extends<ReturnType<typeof WebGl2.Light.builtin>, Light>;
type _WebGl2Builtin = Extends<[WebGl2.Photo, string], Parameters<typeof WebGl2.Light.builtin>>;
type _WebGl2Torch = Extends<
  [WebGl2.Photo, number, number, number?],
  Parameters<typeof WebGl2.Light.torch>
>;
type _WebGl2Linear = Extends<
  [WebGl2.Photo, Float32Array, number, number],
  Parameters<typeof WebGl2.Light.fromLinear>
>;
type _WebGl2Srgb = Extends<
  [WebGl2.Photo, Uint8ClampedArray, number, number],
  Parameters<typeof WebGl2.Light.fromSrgb>
>;
type _WebGl2OutputTransform = Extends<WebGl2.OutputTransform, OutputTransform>;
type _WebGl2OutputTransformOf = Extends<
  ConstructorParameters<RelightModule['OutputTransform']>,
  ConstructorParameters<typeof WebGl2.OutputTransform>
>;
type _WebGl2Relighter = Extends<
  WebGl2.CanvasRelighter,
  Omit<CanvasRelighter, 'render' | 'renderLightImage'>
>;
type _WebGl2Render = Extends<
  [WebGl2.Light, WebGl2.OutputTransform, number],
  Parameters<WebGl2.CanvasRelighter['render']>
>;
type _WebGl2RenderPicture = Extends<
  [WebGl2.OutputTransform, number],
  Parameters<WebGl2.CanvasRelighter['renderLightImage']>
>;

type _WebGpuReceive = Extends<ReturnType<typeof WebGpu.Photo.receive>, ImportedPhoto>;
type _WebGpuParcels = Extends<
  [Float64Array, Float32Array],
  Parameters<typeof WebGpu.Photo.receive>
>;
type _WebGpuLight = Extends<ReturnType<typeof WebGpu.Light.builtin>, Light>;
type _WebGpuBuiltin = Extends<[WebGpu.Photo, string], Parameters<typeof WebGpu.Light.builtin>>;
type _WebGpuTorch = Extends<
  [WebGpu.Photo, number, number, number?],
  Parameters<typeof WebGpu.Light.torch>
>;
type _WebGpuLinear = Extends<
  [WebGpu.Photo, Float32Array, number, number],
  Parameters<typeof WebGpu.Light.fromLinear>
>;
type _WebGpuSrgb = Extends<
  [WebGpu.Photo, Uint8ClampedArray, number, number],
  Parameters<typeof WebGpu.Light.fromSrgb>
>;
type _WebGpuOutputTransform = Extends<WebGpu.OutputTransform, OutputTransform>;
type _WebGpuOutputTransformOf = Extends<
  ConstructorParameters<RelightModule['OutputTransform']>,
  ConstructorParameters<typeof WebGpu.OutputTransform>
>;
type _WebGpuRelighter = Extends<
  WebGpu.CanvasRelighter,
  Omit<CanvasRelighter, 'render' | 'renderLightImage'>
>;
type _WebGpuRender = Extends<
  [WebGpu.Light, WebGpu.OutputTransform, number],
  Parameters<WebGpu.CanvasRelighter['render']>
>;
type _WebGpuRenderPicture = Extends<
  [WebGpu.OutputTransform, number],
  Parameters<WebGpu.CanvasRelighter['renderLightImage']>
>;

type _RelighterOf = Extends<
  [Cpu.Photo, HTMLCanvasElement, Gamut],
  ConstructorParameters<typeof Cpu.CanvasRelighter>
>;
type _RowRangeRelighter = Extends<Cpu.RowRangeRelighter, Omit<RowRangeRelighter, 'relight'>>;
type _View = Extends<
  Parameters<RowRangeRelighter['setView']>,
  Parameters<Cpu.RowRangeRelighter['setView']>
>;
type _RowRangeRelighterOf = Extends<
  [Cpu.Photo, number, number],
  ConstructorParameters<typeof Cpu.RowRangeRelighter>
>;
type _RowRangeRelight = Extends<
  [Float32Array | null, Cpu.OutputTransform, number, Uint8Array],
  Parameters<Cpu.RowRangeRelighter['relight']>
>;
type _Kernel = Extends<ReturnType<typeof Cpu.cpuKernel>, string>;

type _WebGl2Graphics = Extends<WebGl2.GraphicsDevice, Omit<GraphicsDevice, 'draw'>>;
type _WebGl2Draw = Extends<
  [WebGl2.Photo, HTMLCanvasElement, Gamut],
  Parameters<WebGl2.GraphicsDevice['draw']>
>;
type _WebGl2Drawn = Extends<
  ReturnType<WebGl2.GraphicsDevice['draw']>,
  Promise<WebGl2.CanvasRelighter>
>;

type _WebGpuGraphics = Extends<WebGpu.GraphicsDevice, Omit<GraphicsDevice, 'draw'>>;
type _WebGpuDraw = Extends<
  [WebGpu.Photo, HTMLCanvasElement, Gamut],
  Parameters<WebGpu.GraphicsDevice['draw']>
>;
type _WebGpuDrawn = Extends<
  ReturnType<WebGpu.GraphicsDevice['draw']>,
  Promise<WebGpu.CanvasRelighter>
>;
type _WebGpuOpen = Extends<
  ReturnType<typeof WebGpu.GraphicsDevice.webgpu>,
  Promise<WebGpu.GraphicsDevice>
>;
type _WebGl2Open = Extends<[HTMLCanvasElement], Parameters<typeof WebGl2.GraphicsDevice.webgl2>>;

type _Input = Extends<Recoveries.MeasurementInput, MeasurementInput>;
type _CaptureReader = Extends<CaptureReaders.CaptureReader, CaptureReader>;
type _OpenCapture = Extends<
  Parameters<CaptureReaderModule['CaptureReader']['open']>,
  Parameters<typeof CaptureReaders.CaptureReader.open>
>;
type _CaptureBuilder = Extends<Recoveries.CaptureBuilder, CaptureBuilder>;
type _CaptureBuilderOf = Extends<
  ConstructorParameters<RecoveryModule['CaptureBuilder']>,
  ConstructorParameters<typeof Recoveries.CaptureBuilder>
>;
type _Builder = Extends<Recoveries.MeasurementBuilder, MeasurementBuilder>;
type _BuilderOf = Extends<
  ConstructorParameters<RecoveryModule['MeasurementBuilder']>,
  ConstructorParameters<typeof Recoveries.MeasurementBuilder>
>;
type _Recovery = Extends<Recoveries.Recovery, Recovery>;
type _Prepare = Extends<
  [
    Recoveries.MeasurementInput,
    string,
    string | undefined,
    number | undefined,
    (jobs: number) => void,
  ],
  Parameters<typeof Recoveries.Recovery.prepare>
>;
type _TileRecovery = Extends<Recoveries.TileRecovery, TileRecovery>;
type _TileRecoveryOf = Extends<[Uint8Array], ConstructorParameters<typeof Recoveries.TileRecovery>>;
type _Recovered = Extends<Recoveries.RecoveredTransport, RecoveredTransport>;
type _LinearPng = Extends<CaptureReaders.LinearPng, LinearPng>;
type _ReadPhotograph = Extends<
  Parameters<CaptureReaderModule['readPhotograph']>,
  Parameters<typeof CaptureReaders.readPhotograph>
>;
type _ReadPattern = Extends<
  Parameters<CaptureReaderModule['readPattern']>,
  Parameters<typeof CaptureReaders.readPattern>
>;
type _Emission = Extends<ReturnType<typeof Recoveries.emissionOfCodes>, Float32Array>;

export type Contract = [
  _Decoder,
  _Constructor,
  _Finish,
  _Preview,
  _CpuReceive,
  _CpuDescriptor,
  _CpuLight,
  _CpuBuiltin,
  _CpuTorch,
  _CpuLinear,
  _CpuSrgb,
  _CpuOutputTransform,
  _CpuOutputTransformOf,
  _CpuRelighter,
  _CpuRender,
  _CpuRenderPicture,
  _WebGl2Receive,
  _WebGl2Parcels,
  _WebGl2Light,
  _WebGl2Builtin,
  _WebGl2Torch,
  _WebGl2Linear,
  _WebGl2Srgb,
  _WebGl2OutputTransform,
  _WebGl2OutputTransformOf,
  _WebGl2Relighter,
  _WebGl2Render,
  _WebGl2RenderPicture,
  _WebGpuReceive,
  _WebGpuParcels,
  _WebGpuLight,
  _WebGpuBuiltin,
  _WebGpuTorch,
  _WebGpuLinear,
  _WebGpuSrgb,
  _WebGpuOutputTransform,
  _WebGpuOutputTransformOf,
  _WebGpuRelighter,
  _WebGpuRender,
  _WebGpuRenderPicture,
  _RelighterOf,
  _RowRangeRelighter,
  _View,
  _RowRangeRelighterOf,
  _RowRangeRelight,
  _Kernel,
  _WebGl2Graphics,
  _WebGl2Draw,
  _WebGl2Drawn,
  _WebGpuGraphics,
  _WebGpuDraw,
  _WebGpuDrawn,
  _WebGpuOpen,
  _WebGl2Open,
  _Input,
  _CaptureReader,
  _OpenCapture,
  _CaptureBuilder,
  _CaptureBuilderOf,
  _Builder,
  _BuilderOf,
  _Recovery,
  _Prepare,
  _TileRecovery,
  _TileRecoveryOf,
  _Recovered,
  _LinearPng,
  _ReadPhotograph,
  _ReadPattern,
  _Emission,
];
