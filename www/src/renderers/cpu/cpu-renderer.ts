/**
 * Renderer on the CPU: by the page's crew of workers, or by the page where it can have none. A script of its own,
 * which has copies of what it shares with the element's.
 */

import type { CpuModule, Gamut } from '../../engine/types.js';
import type { Photograph } from '../../photo/photograph.js';
import { hasCode, messageOf } from '../../shared/errors.js';
import type { CanvasRenderer } from '../types.js';
import { MainThreadRenderer } from './main-thread-renderer.js';
import type { WorkerPool } from './worker-pool.js';
import { WorkerRenderer } from './worker-renderer.js';

export { WorkerPool } from './worker-pool.js';

/** Sets drawing up on a canvas of its own. */
export type DrawOnCpu = (
  module: CpuModule,
  photograph: Photograph,
  gamut: Gamut,
  signal: AbortSignal,
) => Promise<CanvasRenderer>;

/** What draws on the CPU. */
export interface CpuRenderers {
  readonly draw: DrawOnCpu;
  /** Has what draws get ready, and stay so until what it gives is called. */
  prepare(): () => void;
}

/** Draws by a crew where it can have workers. */
export function cpuRenderers(pool: WorkerPool): CpuRenderers {
  // What the page has once drawn on the CPU it may be drawing still, which keeps tiles from workers; and
  // why it did.
  const withModule = new WeakMap<Photograph, string>();
  const draw: DrawOnCpu = async (module, photograph, gamut, signal) => {
    try {
      if (!withModule.has(photograph)) {
        return await WorkerRenderer.create(module, photograph, pool, gamut);
      }
    } catch (thrown) {
      // Without workers the page does it.
      if (!hasCode(thrown, 'worker-unavailable')) throw thrown;
      withModule.set(photograph, `The page relights without workers: ${messageOf(thrown)}`);
    }
    const warning = withModule.get(photograph) ?? '';
    return await MainThreadRenderer.create(module, photograph, gamut, warning, signal);
  };
  return { draw, prepare: () => pool.gather() };
}
