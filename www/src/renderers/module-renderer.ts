/** Draws on a canvas with a WebAssembly module on the page's thread: WebGPU, WebGL2 or the CPU. */

import { createOutputTransform } from '../engine/output-settings.js';
import type { CanvasRelighter, RelightModule } from '../engine/wasm-exports.js';
import { LightCache } from '../lights/light-cache.js';
import type { ImageLight } from '../lights/light-setting.js';
import type { LoadedPhotograph } from '../photo/photograph.js';
import { toPhotoError } from '../shared/errors.js';
import type { DeviceLease } from './gpu/devices.js';
import { QualityController } from './quality-controller.js';
import type { Renderer } from './types.js';

/** A renderer with a module's relighter. Its `free` frees the relighter and releases the lease of a device. */
export function createModuleRenderer(
  module: RelightModule,
  photograph: LoadedPhotograph,
  relighter: CanvasRelighter,
  canvas: HTMLCanvasElement,
  lease: DeviceLease | null = null,
): Renderer {
  const { kernel, gamut } = relighter;
  const lights = LightCache.of(module, photograph);
  /** Whether the device's light is an uploaded image. */
  let hasUploadedImage = false;
  return {
    canvas,
    kernel,
    gamut,
    qualityController: new QualityController(),
    render(setting, output, quality) {
      const transform = createOutputTransform(module, output, photograph.colorMatrix, gamut);
      try {
        // The device downsamples an image as it is: not for a part of the light plane, or other colours.
        if (!photograph.hasColorMatrix && !photograph.root && upload(relighter, setting.image)) {
          hasUploadedImage = true;
          relighter.renderLightImage(transform, quality);
          return { lightApplied: true, lightError: null };
        }
        const { light, lightApplied, lightError } = lights.get(setting);
        // An image that is no longer readable keeps its last uploaded content.
        hasUploadedImage &&= !lightApplied;
        if (hasUploadedImage) relighter.renderLightImage(transform, quality);
        else relighter.render(light, transform, quality);
        return { lightApplied, lightError };
      } catch (thrown) {
        const { code, message } = toPhotoError(thrown);
        if (code === 'backend-lost') lease?.fail(message);
        throw thrown;
      } finally {
        transform.free();
      }
    },
    free() {
      relighter.free();
      lease?.release();
      lights.free();
    },
  };
}

/** Uploads an image directly to the device, if both support that: its pixels bypass the page's memory. */
function upload(relighter: CanvasRelighter, image: ImageLight | null): boolean {
  const source = image?.uploadable();
  if (!source) return false;
  try {
    return relighter.setLightImage(source.image, source.width, source.height);
  } catch {
    // Reading its pixels, which follows, reports the error.
    return false;
  }
}
