/** Draws on a canvas with a WebAssembly module on the page's thread: WebGPU, WebGL2 or the CPU. */

import { createOutputTransform, type OutputSettings } from '../engine/output-settings.js';
import type { Gamut, ReceivedPhoto, Relighter, RelightModule } from '../engine/types.js';
import type { ImageLight } from '../lights/image-light.js';
import { LightCache } from '../lights/light-cache.js';
import type { LightSetting } from '../lights/light-setting.js';
import { toPhotoError } from '../shared/errors.js';
import { encodePicture } from './canvas-export.js';
import { QualityController } from './quality-controller.js';
import type { CanvasRenderer, FrameResult } from './types.js';

/** The graphics device that a renderer shares with others. */
export interface DeviceHandle {
  /** Reports that the device does not work. */
  fail(reason: string): void;
  release(): void;
}

export class WasmRenderer implements CanvasRenderer {
  readonly encode = encodePicture;
  readonly quality = new QualityController();
  readonly #module: RelightModule;
  readonly #lights: LightCache;
  /** The photograph without tiles. */
  readonly #lightPlane: ReceivedPhoto;
  readonly #relighter: Relighter;
  readonly #device: DeviceHandle | null;
  /** Whether the device's light is an uploaded image. */
  #hasUploadedImage = false;

  /** Frees `lightPlane` and `relighter`, and releases `device`, when it is freed. */
  constructor(
    module: RelightModule,
    lightPlane: ReceivedPhoto,
    relighter: Relighter,
    readonly canvas: HTMLCanvasElement,
    device: DeviceHandle | null = null,
  ) {
    this.#module = module;
    this.#lights = new LightCache(module);
    this.#lightPlane = lightPlane;
    this.#relighter = relighter;
    this.#device = device;
  }

  get kernel(): string {
    return this.#relighter.kernel;
  }

  get gamut(): Gamut {
    return this.#relighter.gamut;
  }

  render(setting: LightSetting, output: OutputSettings, quality: number): FrameResult {
    const transform = createOutputTransform(this.#module, output, this.gamut);
    try {
      if (this.#upload(setting.image)) {
        this.#hasUploadedImage = true;
        this.#relighter.renderLightImage(transform, quality);
        return { lightApplied: true, lightError: null };
      }
      const { light, lightApplied, lightError } = this.#lights.get(setting, this.#lightPlane);
      // An image that is no longer readable keeps its last uploaded content.
      this.#hasUploadedImage &&= !lightApplied;
      if (this.#hasUploadedImage) this.#relighter.renderLightImage(transform, quality);
      else this.#relighter.render(light, transform, quality);
      return { lightApplied, lightError };
    } catch (thrown) {
      const { code, message } = toPhotoError(thrown);
      if (code === 'backend-lost') this.#device?.fail(message);
      throw thrown;
    } finally {
      transform.free();
    }
  }

  /** Uploads an image directly to the device, if both support that: its pixels bypass the page's memory. */
  #upload(image: ImageLight | null): boolean {
    const source = image?.uploadable();
    if (!source) return false;
    try {
      return this.#relighter.setLightImage(source.image, source.width, source.height);
    } catch {
      // Reading its pixels, which follows, reports the error.
      return false;
    }
  }

  free(): void {
    this.#relighter.free();
    this.#device?.release();
    this.#lights.free();
    this.#lightPlane.free();
  }
}
