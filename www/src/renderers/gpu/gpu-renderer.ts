/**
 * Creates renderers for graphics devices. It is a script of its own with copies of what it shares with
 * the element's script.
 */

import type { Photograph } from '../../photo/photograph.js';
import type { CanvasRenderer, RenderOptions } from '../types.js';
import { WasmRenderer } from '../wasm-renderer.js';
import type { Devices, GraphicsBackend, LoadGraphics } from './devices.js';

export { Devices } from './devices.js';

export interface GpuRenderers {
  /** Calls `onLost` at most once. */
  create(
    backend: GraphicsBackend,
    photograph: Photograph,
    options: RenderOptions,
    onLost: (reason: string) => void,
    signal: AbortSignal,
  ): Promise<CanvasRenderer>;
  /** Opens a device; `software` allows a software renderer. The returned function releases it. */
  warmUp(backend: GraphicsBackend, software: boolean): Promise<() => void>;
}

export function gpuRenderers(load: LoadGraphics, devices: Devices): GpuRenderers {
  return {
    async create(backend, photograph, { gamut, software }, onLost, signal) {
      const lease = await devices.lease(load, backend, software, onLost);
      try {
        signal.throwIfAborted();
        const module = await load(backend);
        return await photograph.withModule(
          module,
          async (photo) => {
            const canvas = document.createElement('canvas');
            const relighter = await lease.graphics.draw(photo, canvas, gamut);
            const lightPlane = photograph.createLightPlane(module);
            return new WasmRenderer(module, lightPlane, relighter, canvas, lease);
          },
          { signal },
        );
      } catch (thrown) {
        lease.release();
        throw thrown;
      }
    },
    async warmUp(backend, software) {
      return (await devices.lease(load, backend, software, () => {})).release;
    },
  };
}
