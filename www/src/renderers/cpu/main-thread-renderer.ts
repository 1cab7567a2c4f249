/** Draws with the CPU on the page's thread. If another renderer takes the tiles, the next frame takes them back. */

import type { CpuModule, Gamut } from '../../engine/wasm-exports.js';
import type { LoadedPhotograph } from '../../photo/photograph.js';
import { photoReleased } from '../../shared/errors.js';
import { createModuleRenderer } from '../module-renderer.js';
import { QualityController } from '../quality-controller.js';
import type { Renderer } from '../types.js';

export async function createMainThreadRenderer(
  module: CpuModule,
  photograph: LoadedPhotograph,
  requestedGamut: Gamut,
  warning: string,
  signal: AbortSignal,
): Promise<Renderer> {
  const canvas = document.createElement('canvas');
  /** `null` while the tiles are elsewhere. */
  let renderer: Renderer | null = null;
  let isFreed = false;
  const stop = () => {
    renderer?.free();
    renderer = null;
  };
  const start = (signal?: AbortSignal) =>
    photograph.withModule(
      module,
      (photo) => {
        if (isFreed) throw photoReleased();
        const relighter = new module.CanvasRelighter(photo, canvas, requestedGamut);
        renderer = createModuleRenderer(module, photograph, relighter, canvas);
        return renderer;
      },
      { signal, onLeave: stop },
    );
  const { gamut } = await start(signal);
  return {
    canvas,
    kernel: module.cpuKernel(),
    gamut,
    warning,
    qualityController: new QualityController(),
    render: (...frame) =>
      renderer ? renderer.render(...frame) : start().then((started) => started.render(...frame)),
    free() {
      isFreed = true;
      stop();
    },
  };
}
