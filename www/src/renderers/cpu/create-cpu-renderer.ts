/** Creates renderers for the CPU, with or without workers: a separate script with its own copies of shared code. */

import type { CpuModule, Gamut } from '../../engine/wasm-exports.js';
import type { LoadedPhotograph } from '../../photo/photograph.js';
import { hasCode, messageOf } from '../../shared/errors.js';
import type { Renderer } from '../types.js';
import { createMainThreadRenderer } from './main-thread-renderer.js';
import type { WorkerPool } from './worker-pool.js';
import { createWorkerRenderer } from './worker-renderer.js';

export { WorkerPool } from './worker-pool.js';

export type CpuRendererFactory = ReturnType<typeof cpuRenderers>;

export function cpuRenderers(pool: WorkerPool) {
  // Photographs that were drawn on the page's thread, and why. They stay there, because the page's renderer may still
  // need the tiles.
  const warnings = new WeakMap<LoadedPhotograph, string>();
  return {
    async create(
      module: CpuModule,
      photograph: LoadedPhotograph,
      gamut: Gamut,
      signal: AbortSignal,
    ): Promise<Renderer> {
      if (!warnings.has(photograph)) {
        try {
          return await createWorkerRenderer(module, photograph, pool, gamut);
        } catch (thrown) {
          if (!hasCode(thrown, 'worker-unavailable')) throw thrown;
          warnings.set(photograph, `The page relights without workers: ${messageOf(thrown)}`);
        }
      }
      const warning = warnings.get(photograph) ?? '';
      return await createMainThreadRenderer(module, photograph, gamut, warning, signal);
    },
    /** Starts workers. The returned function releases them. */
    warmUp: () => pool.warmUp(),
  };
}
