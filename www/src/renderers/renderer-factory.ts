/** Creates renderers for a backend. Those of the graphics backends and of the CPU are separate scripts. */

import { loadCpu } from '../engine/core-modules.js';
import { GRAPHICS_LOADERS } from '../engine/graphics-modules.js';
import type { Backend, CpuModule } from '../engine/wasm-exports.js';
import { startWorker } from '../engine/worker-server.js';
import { messageOf, PhotoError } from '../shared/errors.js';
import type { CpuRendererFactory } from './cpu/create-cpu-renderer.js';
import type { GpuRendererFactory } from './gpu/create-gpu-renderer.js';
import type { BackendPreferences, CreateRenderer } from './types.js';

/** More workers would wait for memory and for each other. */
const MAX_WORKERS = 4;
/** Delay of background loading in browsers without `requestIdleCallback`. */
const IDLE_DELAY_MS = 1000;

/** `gpu`, `cpu` and `cpuModule` fetch the parts that not every page needs. */
export function rendererFactory({
  gpu,
  cpu,
  cpuModule,
}: {
  readonly gpu: () => Promise<GpuRendererFactory>;
  readonly cpu: () => Promise<CpuRendererFactory>;
  readonly cpuModule: () => Promise<CpuModule>;
}) {
  const createRenderer: CreateRenderer = async (backend, photograph, options, onLost, signal) => {
    if (backend === 'cpu') {
      const [module, renderers] = await Promise.all([cpuModule(), cpu()]);
      return await renderers.create(module, photograph, options.gamut, signal);
    }
    const renderers = await gpu();
    signal.throwIfAborted();
    const renderer = await renderers.create(backend, photograph, options, onLost, signal);
    // The CPU replaces a device that is lost, perhaps when the network is gone too.
    whenIdle(() => Promise.allSettled([cpuModule(), cpu()]));
    return renderer;
  };
  const warmUp = async (backend: Backend, preferences: BackendPreferences, signal: AbortSignal) => {
    if (backend !== 'cpu') {
      const renderers = await gpu();
      return signal.aborted ? () => {} : await renderers.warmUp(backend, preferences, signal);
    }
    // Workers that start earlier would wait for the module that the page is still fetching.
    const [renderers] = await Promise.all([cpu(), cpuModule()]);
    return signal.aborted ? () => {} : renderers.warmUp();
  };
  /** Warms up the first backend that works until `signal` is aborted. Errors are left to `createRenderer`. */
  const prepare = async (preferences: BackendPreferences, signal: AbortSignal) => {
    for (const backend of preferences.backends) {
      if (signal.aborted) return;
      try {
        const release = await warmUp(backend, preferences, signal);
        if (signal.aborted) release();
        else signal.addEventListener('abort', release);
        return;
      } catch {
        // The next backend may work.
      }
    }
  };
  return { createRenderer, prepare };
}

const poolSize = Math.min(MAX_WORKERS, globalThis.navigator?.hardwareConcurrency ?? 1);

export const { createRenderer, prepare } = rendererFactory({
  gpu: loadOnce(async () => {
    const { gpuRenderers } = await import('./gpu/create-gpu-renderer.js');
    return gpuRenderers((name) => GRAPHICS_LOADERS[name]());
  }),
  cpu: loadOnce(async () => {
    const { WorkerPool, cpuRenderers } = await import('./cpu/create-cpu-renderer.js');
    return cpuRenderers(new WorkerPool(startRelightWorker, poolSize));
  }),
  cpuModule: loadCpu,
});

function startRelightWorker(): Worker | null {
  return startWorker(
    () =>
      new Worker(new URL('./relightable-photo-relighter.js', import.meta.url), { type: 'module' }),
  );
}

/** Loads a script once; after a failure the next call tries again. */
function loadOnce<T>(load: () => Promise<T>): () => Promise<T> {
  let loading: Promise<T> | null = null;
  return () => {
    loading ??= load().catch((cause: unknown) => {
      loading = null;
      const failure = `its script could not be loaded (${messageOf(cause)})`;
      const remedy = "It must lie beside the element's script";
      throw new PhotoError('backend-unavailable', `${failure}. ${remedy}`, cause);
    });
    return loading;
  };
}

function whenIdle(work: () => unknown): void {
  const { requestIdleCallback } = globalThis;
  if (requestIdleCallback) requestIdleCallback(() => void work());
  else setTimeout(work, IDLE_DELAY_MS);
}
