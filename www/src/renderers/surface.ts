/** A canvas with a back end of the page's own module on it. */

import { type Look, makeDisplay } from '../engine/output-settings.js';
import type { DrawingModule, DrawnPhoto, Gamut, Relighter } from '../engine/types.js';
import { Lamp } from '../lights/light-cache.js';
import type { LightSetting } from '../lights/light-setting.js';
import type { Projection } from '../lights/projection.js';
import { toPhotoError } from '../shared/errors.js';
import type { Lease } from './gpu/devices.js';
import type { CanvasRenderer, FrameResult } from './types.js';

/** See the module. */
export class WasmRenderer implements CanvasRenderer {
  readonly canvas: HTMLCanvasElement;
  readonly warning: string;
  readonly #module: DrawingModule;
  readonly #lamp: Lamp;
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
    this.#lamp = new Lamp(module);
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

  render(setting: LightSetting, look: Look, detail: number): FrameResult {
    const display = makeDisplay(this.#module, look, this.gamut);
    try {
      if (this.#takes(setting.picture)) {
        this.#pictured = true;
        this.#relighter.renderPicture(display, detail);
        return { lightApplied: true, lightError: null };
      }
      const { light, asked, fault } = this.#lamp.turnTo(setting, this.#plane);
      // A picture that cannot be had any more leaves what was had of it.
      this.#pictured &&= !asked;
      if (this.#pictured) this.#relighter.renderPicture(display, detail);
      else this.#relighter.render(light, display, detail);
      return { lightApplied: asked, lightError: fault };
    } catch (thrown) {
      const { code, message } = toPhotoError(thrown);
      if (code === 'backend-lost') this.#lease?.fail(message);
      throw thrown;
    } finally {
      display.free();
    }
  }

  /** Whether the device takes a picture as it is, which spares it a way through the page's memory. */
  #takes(projection: Projection | null): boolean {
    const live = projection?.live();
    if (!live) return false;
    try {
      return this.#relighter.takePicture(live.picture, live.width, live.height);
    } catch {
      // Reading it tells what is wrong.
      return false;
    }
  }

  free(): void {
    this.#relighter.free();
    this.#lease?.release();
    this.#lamp.free();
    this.#plane.free();
  }
}
