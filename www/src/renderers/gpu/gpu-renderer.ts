/** Renderer by graphics devices. A script of its own, which has copies of what it shares with the element's. */

import type { Photograph } from '../../photo/photograph.js';
import { WasmRenderer } from '../surface.js';
import type { CanvasRenderer, RenderOptions } from '../types.js';
import type { Devices, GraphicsBackend, LoadGraphics } from './devices.js';

export { Devices } from './devices.js';

/** What draws by graphics devices. */
export interface GpuRenderers {
  /** Sets drawing up on a canvas of its own. `lost` is told at most once. */
  draw(
    backend: GraphicsBackend,
    photograph: Photograph,
    renderOptions: RenderOptions,
    lost: (reason: string) => void,
    signal: AbortSignal,
  ): Promise<CanvasRenderer>;
  /** Has a device get ready, and stay so until what it gives is called; `software`: also a program. */
  prepare(backend: GraphicsBackend, software: boolean): Promise<() => void>;
}

/** Draws by devices, with the modules that `load` gives. */
export function gpuRenderers(load: LoadGraphics, devices: Devices): GpuRenderers {
  return {
    async draw(backend, photograph, { gamut, software }, lost, signal) {
      const lease = await devices.lease(load, backend, software, lost);
      const { graphics } = lease;
      try {
        signal.throwIfAborted();
        const module = await load(backend);
        return await photograph.withModule(
          module,
          async (photo) => {
            const canvas = document.createElement('canvas');
            const relighter = await graphics.draw(photo, canvas, gamut);
            const plane = photograph.plane(module);
            return new WasmRenderer(module, plane, relighter, canvas, { lease });
          },
          { signal },
        );
      } catch (thrown) {
        lease.release();
        throw thrown;
      }
    },
    async prepare(backend, software) {
      return (await devices.lease(load, backend, software, () => {})).release;
    },
  };
}
