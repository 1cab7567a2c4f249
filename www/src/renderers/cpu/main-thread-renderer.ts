/** A canvas that the page draws on the CPU. Tiles may leave its module; they are back for the next picture. */

import type { Look } from '../../engine/output-settings.js';
import type { CpuModule, Gamut } from '../../engine/types.js';
import type { LightSetting } from '../../lights/light-setting.js';
import type { Photograph } from '../../photo/photograph.js';
import type { Drawn } from '../../player/photo-session.js';
import { letGo } from '../../shared/errors.js';
import type { CanvasSurface } from '../canvas-surface.js';
import { CanvasDrawing } from '../surface.js';

/** See the module. */
export class PageDrawing implements CanvasSurface {
  readonly canvas: HTMLCanvasElement;
  readonly kernel: string;
  readonly flaw: string;
  gamut: Gamut;
  readonly #module: CpuModule;
  readonly #photograph: Photograph;
  /** None while tiles are elsewhere. */
  #drawing: CanvasDrawing | null = null;
  #freed = false;

  private constructor(module: CpuModule, photograph: Photograph, gamut: Gamut, flaw: string) {
    this.canvas = document.createElement('canvas');
    this.kernel = module.cpuKernel();
    this.gamut = gamut;
    this.flaw = flaw;
    this.#module = module;
    this.#photograph = photograph;
  }

  static async create(
    module: CpuModule,
    photograph: Photograph,
    gamut: Gamut,
    flaw: string,
    signal: AbortSignal,
  ): Promise<PageDrawing> {
    const drawing = new PageDrawing(module, photograph, gamut, flaw);
    drawing.gamut = (await drawing.#begin(signal)).gamut;
    return drawing;
  }

  render(setting: LightSetting, look: Look, detail: number): Drawn | Promise<Drawn> {
    if (this.#drawing) return this.#drawing.render(setting, look, detail);
    return this.#begin().then((drawing) => drawing.render(setting, look, detail));
  }

  free(): void {
    this.#freed = true;
    this.#stop();
  }

  #begin(signal?: AbortSignal): Promise<CanvasDrawing> {
    const use = (photo: Parameters<Parameters<Photograph['inPage']>[1]>[0]) => {
      if (this.#freed) throw letGo();
      const relighter = new this.#module.Relighter(photo, this.canvas, this.gamut);
      const plane = this.#photograph.plane(this.#module);
      this.#drawing = new CanvasDrawing(this.#module, plane, relighter, this.canvas);
      return this.#drawing;
    };
    const leave = () => this.#stop();
    return this.#photograph.inPage(this.#module, use, signal ? { signal, leave } : { leave });
  }

  #stop(): void {
    this.#drawing?.free();
    this.#drawing = null;
  }
}
