/**
 * Draws with the CPU on the page's thread. If another renderer moves the tiles away, the next frame moves them back.
 */

import type { OutputSettings } from '../../engine/output-settings.js';
import type { CpuModule, Gamut, ReceivedPhoto } from '../../engine/types.js';
import type { LightSetting } from '../../lights/light-setting.js';
import type { Photograph } from '../../photo/photograph.js';
import { photoReleased } from '../../shared/errors.js';
import { encodePicture } from '../canvas-export.js';
import { QualityController } from '../quality-controller.js';
import type { CanvasRenderer, FrameResult } from '../types.js';
import { WasmRenderer } from '../wasm-renderer.js';

export class MainThreadRenderer implements CanvasRenderer {
  readonly encode = encodePicture;
  readonly quality = new QualityController();
  readonly canvas = document.createElement('canvas');
  readonly kernel: string;
  readonly #module: CpuModule;
  readonly #photograph: Photograph;
  /** `null` while the tiles are elsewhere. */
  #renderer: WasmRenderer | null = null;
  #isFreed = false;

  private constructor(
    module: CpuModule,
    photograph: Photograph,
    public gamut: Gamut,
    readonly warning: string,
  ) {
    this.kernel = module.cpuKernel();
    this.#module = module;
    this.#photograph = photograph;
  }

  static async create(
    module: CpuModule,
    photograph: Photograph,
    gamut: Gamut,
    warning: string,
    signal: AbortSignal,
  ): Promise<MainThreadRenderer> {
    const renderer = new MainThreadRenderer(module, photograph, gamut, warning);
    renderer.gamut = (await renderer.#begin(signal)).gamut;
    return renderer;
  }

  render(
    setting: LightSetting,
    output: OutputSettings,
    quality: number,
  ): FrameResult | Promise<FrameResult> {
    if (this.#renderer) return this.#renderer.render(setting, output, quality);
    return this.#begin().then((renderer) => renderer.render(setting, output, quality));
  }

  free(): void {
    this.#isFreed = true;
    this.#stop();
  }

  #begin(signal?: AbortSignal): Promise<WasmRenderer> {
    const use = (photo: ReceivedPhoto) => {
      if (this.#isFreed) throw photoReleased();
      const relighter = new this.#module.Relighter(photo, this.canvas, this.gamut);
      const lightPlane = this.#photograph.createLightPlane(this.#module);
      this.#renderer = new WasmRenderer(this.#module, lightPlane, relighter, this.canvas);
      return this.#renderer;
    };
    const onLeave = () => this.#stop();
    return this.#photograph.withModule(this.#module, use, { signal, onLeave });
  }

  #stop(): void {
    this.#renderer?.free();
    this.#renderer = null;
  }
}
