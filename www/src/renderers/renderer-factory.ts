/** Who draws for an element: a graphics device, or the CPU. Each is a script of its own, fetched where it is needed. */

import { loadCpu } from '../engine/cpu-module.js';
import type { Backend, CpuModule, Modules } from '../engine/types.js';
import { moduleFolder } from '../engine/wasm-loader.js';
import { loadWebGl2 } from '../engine/webgl2-module.js';
import { loadWebGpu } from '../engine/webgpu-module.js';
import type { Photograph } from '../photo/photograph.js';
import { messageOf, PhotoError } from '../shared/errors.js';
import type { Start } from '../shared/worker-scope.js';
import type { CpuRenderers } from './cpu/cpu-renderer.js';
import type { GpuRenderers } from './gpu/gpu-renderer.js';
import type { CanvasRenderer, RenderOptions } from './types.js';

/** More would wait for memory, and for each other. */
const MOST_WORKERS = 4;

/** Sets a back end up on a canvas of its own: one used by one API cannot be used by another. */
export type Draw = (
  backend: Backend,
  photograph: Photograph,
  renderOptions: RenderOptions,
  lost: (reason: string) => void,
  signal: AbortSignal,
) => Promise<CanvasRenderer>;

/**
 * Has the first back end of an order that works get ready, which takes a while, and stay so until `over` is
 * aborted. What goes wrong is told to who draws.
 */
export type Prepare = (renderOptions: RenderOptions, over: AbortSignal) => Promise<void>;

/** What draws. */
export interface RendererFactory {
  readonly draw: Draw;
  readonly prepare: Prepare;
}

/** Where what draws comes from. */
export interface RendererScripts {
  readonly gpu: () => Promise<GpuRenderers>;
  readonly cpu: () => Promise<CpuRenderers>;
  readonly cpuModule: () => Promise<CpuModule>;
}

/**
 * Draws by what is given. A device that cannot be had leaves tiles where they are, and keeps nobody from them
 * while it is asked for.
 */
export function drawer({ gpu, cpu, cpuModule }: RendererScripts): RendererFactory {
  const draw: Draw = async (backend, photograph, renderOptions, lost, signal) => {
    if (backend === 'cpu') {
      const [module, drawer] = await Promise.all([cpuModule(), cpu()]);
      return await drawer.draw(module, photograph, renderOptions.gamut, signal);
    }
    const drawer = await gpu();
    signal.throwIfAborted();
    const renderer = await drawer.draw(backend, photograph, renderOptions, lost, signal);
    idle(() => Promise.allSettled([cpuModule(), cpu()]));
    return renderer;
  };
  const prepare: Prepare = async ({ backends, software }, over) => {
    for (const backend of backends) {
      if (over.aborted) return;
      try {
        let letGo: () => void;
        if (backend === 'cpu') {
          // Workers that start sooner would have to wait for a module that the page waits for too.
          const [drawer] = await Promise.all([cpu(), cpuModule()]);
          if (over.aborted) return;
          letGo = drawer.prepare();
        } else {
          const drawer = await gpu();
          if (over.aborted) return;
          letGo = await drawer.prepare(backend, software);
        }
        if (over.aborted) letGo();
        else over.addEventListener('abort', letGo);
        return;
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

const crewSize = Math.min(MOST_WORKERS, globalThis.navigator?.hardwareConcurrency ?? 1);

/** Draws for the elements of this page. */
export const { draw, prepare } = drawer({
  gpu: once(async () => {
    const { Devices, gpuRenderers } = await import('./gpu/gpu-renderer.js');
    return gpuRenderers((name) => LOADERS[name](), new Devices());
  }),
  cpu: once(async () => {
    const { WorkerPool, cpuRenderers } = await import('./cpu/cpu-renderer.js');
    return cpuRenderers(new WorkerPool(startWorker, crewSize));
  }),
  cpuModule: loadCpu,
});

/** A script that draws: fetched once. Where it did not come, the next asks again; some browsers answer as before. */
function once<T>(fetchScript: () => Promise<T>): () => Promise<T> {
  let fetching: Promise<T> | null = null;
  return () => {
    fetching ??= fetchScript().catch((cause: unknown) => {
      fetching = null;
      const why = `the script that draws could not be loaded (${messageOf(cause)}). It has to lie beside the element's`;
      throw new PhotoError('backend-unavailable', why, cause);
    });
    return fetching;
  };
}

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
