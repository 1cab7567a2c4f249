/**
 * Drawing on the CPU: by the page's crew of workers, or by the page where it can have none. A script of its own,
 * which has copies of what it shares with the element's.
 */

import type { CpuModule, Gamut } from '../../engine/types.js';
import type { Photograph } from '../../photo/photograph.js';
import { hasCode, messageOf } from '../../shared/errors.js';
import type { CanvasSurface } from '../canvas-surface.js';
import { PageDrawing } from './main-thread-renderer.js';
import type { Crew } from './worker-pool.js';
import { CrewDrawing } from './worker-renderer.js';

export { Crew } from './worker-pool.js';

/** Sets drawing up on a canvas of its own. */
export type DrawOnCpu = (
  module: CpuModule,
  photograph: Photograph,
  gamut: Gamut,
  signal: AbortSignal,
) => Promise<CanvasSurface>;

/** What draws on the CPU. */
export interface CpuDrawer {
  readonly draw: DrawOnCpu;
  /** Has what draws get ready, and stay so until what it gives is called. */
  prepare(): () => void;
}

/** Draws by a crew where it can have workers. */
export function cpuDrawer(crew: Crew): CpuDrawer {
  // What the page has once drawn on the CPU it may be drawing still, which keeps tiles from workers; and
  // why it did.
  const inPage = new WeakMap<Photograph, string>();
  const draw: DrawOnCpu = async (module, photograph, gamut, signal) => {
    try {
      if (!inPage.has(photograph)) {
        return await CrewDrawing.create(module, photograph, crew, gamut);
      }
    } catch (thrown) {
      // Without workers the page does it.
      if (!hasCode(thrown, 'worker-unavailable')) throw thrown;
      inPage.set(photograph, `The page relights without workers: ${messageOf(thrown)}`);
    }
    const flaw = inPage.get(photograph) ?? '';
    return await PageDrawing.create(module, photograph, gamut, flaw, signal);
  };
  return { draw, prepare: () => crew.gather() };
}
