/** A canvas that the page draws on the CPU. Tiles may leave its module; they are back for the next picture. */

import type { OutputSettings } from '../../engine/output-settings.js';
import type { CpuModule, Gamut } from '../../engine/types.js';
import type { LightSetting } from '../../lights/light-setting.js';
import type { Photograph } from '../../photo/photograph.js';
import { letGo } from '../../shared/errors.js';
import { WasmRenderer } from '../surface.js';
import type { CanvasRenderer, FrameResult } from '../types.js';

/** See the module. */
export class MainThreadRenderer implements CanvasRenderer {
  readonly canvas: HTMLCanvasElement;
  readonly kernel: string;
  readonly warning: string;
  gamut: Gamut;
  readonly #module: CpuModule;
  readonly #photograph: Photograph;
  /** None while tiles are elsewhere. */
  #renderer: WasmRenderer | null = null;
  #freed = false;

  private constructor(module: CpuModule, photograph: Photograph, gamut: Gamut, warning: string) {
    this.canvas = document.createElement('canvas');
    this.kernel = module.cpuKernel();
    this.gamut = gamut;
    this.warning = warning;
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
    detail: number,
  ): FrameResult | Promise<FrameResult> {
    if (this.#renderer) return this.#renderer.render(setting, output, detail);
    return this.#begin().then((renderer) => renderer.render(setting, output, detail));
  }

  free(): void {
    this.#freed = true;
    this.#stop();
  }

  #begin(signal?: AbortSignal): Promise<WasmRenderer> {
    const use = (photo: Parameters<Parameters<Photograph['withModule']>[1]>[0]) => {
      if (this.#freed) throw letGo();
      const relighter = new this.#module.Relighter(photo, this.canvas, this.gamut);
      const plane = this.#photograph.plane(this.#module);
      this.#renderer = new WasmRenderer(this.#module, plane, relighter, this.canvas);
      return this.#renderer;
    };
    const leave = () => this.#stop();
    return this.#photograph.withModule(this.#module, use, signal ? { signal, leave } : { leave });
  }

  #stop(): void {
    this.#renderer?.free();
    this.#renderer = null;
  }
}
