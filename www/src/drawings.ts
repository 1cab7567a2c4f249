/** Who draws for an element: a back end in the page, or on the CPU the page's crew of workers. */

import type { CanvasSurface } from './canvas.js';
import { loadCpu } from './cpu-module.js';
import { Crew } from './crew.js';
import { CrewDrawing } from './crew-drawing.js';
import { Devices, slowerThanCpu } from './devices.js';
import type { Backend, Modules } from './engine.js';
import { PhotoError } from './errors.js';
import { PageDrawing } from './page-drawing.js';
import type { Photograph } from './photograph.js';
import type { Wanted } from './player.js';
import { CanvasDrawing } from './surface.js';
import { moduleFolder } from './wasm-start.js';
import { loadWebGl2 } from './webgl2-module.js';
import { loadWebGpu } from './webgpu-module.js';
import type { Start } from './worker-scope.js';

/** More would wait for memory, and for each other. */
const MOST_WORKERS = 4;

/** Sets a back end up on a canvas of its own: one used by one API cannot be used by another. */
export type Draw = (
  backend: Backend,
  photograph: Photograph,
  wanted: Wanted,
  lost: (reason: string) => void,
  signal: AbortSignal,
) => Promise<CanvasSurface>;

/** Gives the modules that draw. */
export type Load = <B extends Backend>(backend: B) => Promise<Modules[B]>;

/**
 * Draws by the modules that `load` gives, and on the CPU by a crew where it can have workers. A device
 * that cannot be had leaves tiles where they are, and keeps nobody from them while it is asked for.
 */
export function drawer(load: Load, crew: Crew, devices: Devices): Draw {
  // What the page has once drawn on the CPU it may be drawing still, which keeps tiles from workers; and
  // why it did.
  const inPage = new WeakMap<Photograph, string>();
  return async (backend, photograph, { gamut, software }, lost, signal) => {
    if (backend === 'cpu') {
      const module = await load('cpu');
      try {
        if (!inPage.has(photograph)) {
          return await CrewDrawing.create(module, photograph, crew, gamut);
        }
      } catch (thrown) {
        // Without workers the page does it.
        if (!(thrown instanceof PhotoError && thrown.code === 'worker-unavailable')) throw thrown;
        inPage.set(photograph, `The page relights without workers: ${thrown.message}`);
      }
      const flaw = inPage.get(photograph) ?? '';
      return await PageDrawing.create(module, photograph, gamut, flaw, signal);
    }
    const lease = await devices.lease(load, backend, lost);
    const { graphics } = lease;
    try {
      if (graphics.software && !software) throw slowerThanCpu(backend, graphics.kernel);
      const module = await load(backend);
      return await photograph.inPage(
        module,
        async (photo) => {
          const canvas = document.createElement('canvas');
          const relighter = await graphics.draw(photo, canvas, gamut);
          const plane = photograph.plane(module);
          const drawing = new CanvasDrawing(module, plane, relighter, canvas, { lease });
          idle(() => load('cpu').catch(() => {}));
          return drawing;
        },
        { signal },
      );
    } catch (thrown) {
      lease.release();
      throw thrown;
    }
  };
}

const LOADERS: { readonly [B in Backend]: () => Promise<Modules[B]> } = {
  cpu: loadCpu,
  webgl2: loadWebGl2,
  webgpu: loadWebGpu,
};
const load: Load = (name) => LOADERS[name]();

const crewSize = Math.min(MOST_WORKERS, globalThis.navigator?.hardwareConcurrency ?? 1);

/** Draws for the elements of this page. */
export const draw = drawer(load, new Crew(startWorker, crewSize), new Devices());

/** Does something once the page has nothing else to do: what takes a device's place is there when it is lost. */
function idle(work: () => unknown): void {
  const { requestIdleCallback } = globalThis;
  // Not every browser has it.
  if (requestIdleCallback) requestIdleCallback(() => void work());
  else setTimeout(work, 1000);
}

/** `null` where a script of this origin may not be a worker, or modules cannot be. */
function startWorker(): Worker | null {
  try {
    // The address is written out for bundlers, which look for exactly this form.
    const worker = new Worker(new URL('./relightable-photo-relighter.js', import.meta.url), {
      type: 'module',
    });
    worker.postMessage({ kind: 'start', modules: moduleFolder() } satisfies Start);
    return worker;
  } catch {
    return null;
  }
}
