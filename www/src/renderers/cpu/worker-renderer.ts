/** Draws with the CPU in the page's worker pool; the page copies the pixels to the canvas. */

import type { CpuModule, Gamut } from '../../engine/wasm-exports.js';
import { LightCache } from '../../lights/light-cache.js';
import type { LoadedPhotograph } from '../../photo/photograph.js';
import { hasCode, messageOf, PhotoError, photoReleased } from '../../shared/errors.js';
import { QualityController } from '../quality-controller.js';
import type { Renderer } from '../types.js';
import type { WorkerPool } from './worker-pool.js';

/** Rejects with `worker-unavailable` if there are no workers; the photograph is unchanged then. */
export async function createWorkerRenderer(
  module: CpuModule,
  photograph: LoadedPhotograph,
  pool: WorkerPool,
  requestedGamut: Gamut,
): Promise<Renderer> {
  const canvas = document.createElement('canvas');
  canvas.width = photograph.descriptor.width;
  canvas.height = photograph.descriptor.height;
  // Keeps the canvas in the page's memory: a software renderer would copy every frame twice.
  const context = canvas.getContext('2d', { colorSpace: requestedGamut, willReadFrequently: true });
  if (!context) {
    throw new PhotoError('backend-unavailable', 'The browser has no canvas with a 2D context.');
  }
  const kernel = await photograph.withWorkers(pool, ({ kernel, size }) => {
    return `${kernel}, ${size} ${size === 1 ? 'worker' : 'workers'}`;
  });
  // A browser without support for the gamut ignores it.
  const { colorSpace } = context.getContextAttributes?.() ?? {};
  const gamut = colorSpace === requestedGamut ? requestedGamut : 'srgb';
  const lights = LightCache.of(module, photograph);
  const { colorMatrix } = photograph;
  const whole = { left: 0, top: 0, right: canvas.width, bottom: canvas.height };
  let isFreed = false;
  const checkNotFreed = () => {
    if (isFreed) throw photoReleased();
  };
  return {
    canvas,
    kernel,
    gamut,
    qualityController: new QualityController(),
    async render(setting, output, quality, { view = whole, ready } = {}) {
      checkNotFreed();
      try {
        return await photograph.withWorkers(pool, async (session) => {
          checkNotFreed();
          const { light, ...result } = lights.get(setting);
          const settings = { output, colorMatrix, gamut, quality, view };
          const picture = await session.relight(light, settings);
          await ready?.();
          checkNotFreed();
          // All rows in one task, before the next frame reuses their memory.
          for (const { firstRow, rows, pixels } of picture) {
            const data = new Uint8ClampedArray(pixels);
            const image = new ImageData(data, canvas.width, rows, { colorSpace: gamut });
            const { left, top, right, bottom } = view;
            const [width, height] = [right - left, bottom - top];
            context.putImageData(image, 0, firstRow, left, top - firstRow, width, height);
          }
          return result;
        });
      } catch (thrown) {
        if (!hasCode(thrown, 'worker-unavailable')) throw thrown;
        // Once the photograph is fetched again, it is drawn on the page's thread.
        throw new PhotoError('photo-lost', messageOf(thrown), thrown);
      }
    },
    free() {
      if (!isFreed) lights.free();
      isFreed = true;
    },
  };
}
