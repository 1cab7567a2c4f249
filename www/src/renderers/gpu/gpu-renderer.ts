/**
 * Creates renderers for graphics devices. It is a script of its own with copies of what it shares with the element's
 * script.
 */

import type { Photograph } from '../../photo/photograph.js';
import type { CanvasRenderer, RenderOptions } from '../types.js';
import { WasmRenderer } from '../wasm-renderer.js';
import type { Devices, GraphicsBackend, LoadGraphics } from './devices.js';

export { Devices } from './devices.js';

export type GpuRenderers = ReturnType<typeof gpuRenderers>;

export function gpuRenderers(load: LoadGraphics, devices: Devices) {
  return {
    async create(
      backend: GraphicsBackend,
      photograph: Photograph,
      { gamut, software }: RenderOptions,
      onLost: (reason: string) => void,
      signal: AbortSignal,
    ): Promise<CanvasRenderer> {
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
    /** Opens a device. The returned function releases it. */
    async warmUp(backend: GraphicsBackend, software: boolean): Promise<() => void> {
      return (await devices.lease(load, backend, software, () => {})).release;
    },
  };
}
