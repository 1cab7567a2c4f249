/** A canvas with a back end of the page's own module on it. */

import { makeDisplay, type OutputSettings } from '../engine/output-settings.js';
import type { DrawingModule, DrawnPhoto, Gamut, Relighter } from '../engine/types.js';
import type { ImageLight } from '../lights/image-light.js';
import { LightCache } from '../lights/light-cache.js';
import type { LightSetting } from '../lights/light-setting.js';
import { toPhotoError } from '../shared/errors.js';
import type { Lease } from './gpu/devices.js';
import type { CanvasRenderer, FrameResult } from './types.js';

/** See the module. */
export class WasmRenderer implements CanvasRenderer {
  readonly canvas: HTMLCanvasElement;
  readonly warning: string;
  readonly #module: DrawingModule;
  readonly #lights: LightCache;
  /** What lights are made for; its own. */
  readonly #plane: DrawnPhoto;
  readonly #relighter: Relighter;
  /** Whether the device has a picture as its light. */
  #pictured = false;
  readonly #lease: Pick<Lease, 'fail' | 'release'> | null;

  /** `plane`, the photograph without tiles, is freed with this. On a device, `lease` is the share of it, which is given up at the end. */
  constructor(
    module: DrawingModule,
    plane: DrawnPhoto,
    relighter: Relighter,
    canvas: HTMLCanvasElement,
    {
      lease = null,
      warning = '',
    }: { lease?: Pick<Lease, 'fail' | 'release'> | null; warning?: string } = {},
  ) {
    this.#module = module;
    this.#lights = new LightCache(module);
    this.#plane = plane;
    this.#relighter = relighter;
    this.#lease = lease;
    this.warning = warning;
    this.canvas = canvas;
  }

  get kernel(): string {
    return this.#relighter.kernel;
  }

  get gamut(): Gamut {
    return this.#relighter.gamut;
  }

  render(setting: LightSetting, output: OutputSettings, detail: number): FrameResult {
    const display = makeDisplay(this.#module, output, this.gamut);
    try {
      if (this.#takes(setting.image)) {
        this.#pictured = true;
        this.#relighter.renderPicture(display, detail);
        return { lightApplied: true, lightError: null };
      }
      const { light, lightApplied, lightError } = this.#lights.get(setting, this.#plane);
      // A picture that cannot be had any more leaves what was had of it.
      this.#pictured &&= !lightApplied;
      if (this.#pictured) this.#relighter.renderPicture(display, detail);
      else this.#relighter.render(light, display, detail);
      return { lightApplied, lightError };
    } catch (thrown) {
      const { code, message } = toPhotoError(thrown);
      if (code === 'backend-lost') this.#lease?.fail(message);
      throw thrown;
    } finally {
      display.free();
    }
  }

  /** Whether the device takes a picture as it is, which spares it a way through the page's memory. */
  #takes(image: ImageLight | null): boolean {
    const source = image?.uploadable();
    if (!source) return false;
    try {
      return this.#relighter.takePicture(source.image, source.width, source.height);
    } catch {
      // Reading it tells what is wrong.
      return false;
    }
  }

  free(): void {
    this.#relighter.free();
    this.#lease?.release();
    this.#lights.free();
    this.#plane.free();
  }
}
