/** Who draws for an element: a back end in the page, or on the CPU the page's crew of workers. */

import type { CanvasSurface } from './canvas.js';
import type { CpuDrawer } from './cpu-drawing.js';
import { loadCpu } from './cpu-module.js';
import { Devices, slowerThanCpu, unavailable } from './devices.js';
import type { Backend, Modules } from './engine.js';
import { messageOf } from './errors.js';
import { Lamp } from './lamp.js';
import type { Tools } from './page-drawing.js';
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

/**
 * Has the first back end of an order that works get ready, which takes a while, and stay so until `over` is
 * aborted. What goes wrong is told to who draws.
 */
export type Prepare = (wanted: Wanted, over: AbortSignal) => Promise<void>;

/** Gives the modules that draw. */
export type Load = <B extends Backend>(backend: B) => Promise<Modules[B]>;

/** What draws. */
export interface Drawer {
  readonly draw: Draw;
  readonly prepare: Prepare;
}

/**
 * Draws by the modules that `load` gives, on the CPU as `cpu` does. A device that cannot be had leaves tiles
 * where they are, and keeps nobody from them while it is asked for.
 */
export function drawer(load: Load, cpu: () => Promise<CpuDrawer>, devices: Devices): Drawer {
  const draw: Draw = async (backend, photograph, { gamut, software }, lost, signal) => {
    if (backend === 'cpu') {
      const [module, drawer] = await Promise.all([load('cpu'), cpu()]);
      return await drawer.draw(module, photograph, gamut, signal);
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
          idle(() => Promise.allSettled([load('cpu'), cpu()]));
          return drawing;
        },
        { signal },
      );
    } catch (thrown) {
      lease.release();
      throw thrown;
    }
  };
  const prepare: Prepare = async ({ backends, software }, over) => {
    const hold = (letGo: () => void): void => {
      if (over.aborted) letGo();
      else over.addEventListener('abort', letGo);
    };
    for (const backend of backends) {
      if (over.aborted) return;
      try {
        if (backend === 'cpu') {
          const [, drawer] = await Promise.all([load(backend), cpu()]);
          hold(drawer.prepare());
          return;
        }
        const { graphics, release } = await devices.lease(load, backend, () => {});
        // Also one that is passed over: it would be asked for again.
        hold(release);
        if (software || !graphics.software) return;
      } catch {
        // The next may work.
      }
    }
  };
  return { draw, prepare };
}

const LOADERS: { readonly [B in Backend]: () => Promise<Modules[B]> } = {
  cpu: loadCpu,
  webgl2: loadWebGl2,
  webgpu: loadWebGpu,
};
const load: Load = (name) => LOADERS[name]();

const crewSize = Math.min(MOST_WORKERS, globalThis.navigator?.hardwareConcurrency ?? 1);

export const TOOLS: Tools = {
  newLamp: (module) => new Lamp(module),
  newDrawing: (...parts) => new CanvasDrawing(...parts),
};

let cpuDrawing: Promise<CpuDrawer> | null = null;

/** The script that draws on the CPU, with the page's crew: fetched once, and again where it did not come. */
function fetchCpu(): Promise<CpuDrawer> {
  cpuDrawing ??= import('./cpu-drawing.js').then(
    ({ Crew, cpuDrawer }) => cpuDrawer(new Crew(startWorker, crewSize), TOOLS),
    (cause) => {
      cpuDrawing = null;
      const remedy = "It has to lie beside the element's";
      const what = `the script that draws could not be loaded (${messageOf(cause)})`;
      throw unavailable(`${what}. ${remedy}`, cause);
    },
  );
  return cpuDrawing;
}

/** Draws for the elements of this page. */
export const { draw, prepare } = drawer(load, fetchCpu, new Devices());

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
