/** Creates renderers for graphics devices. It is a separate script, which has its own copies of shared code. */

import type { LoadedPhotograph } from '../../photo/photograph.js';
import { createModuleRenderer } from '../module-renderer.js';
import type { BackendPreferences, Renderer } from '../types.js';
import { type DevicePreferences, Devices, type LoadGraphics } from './devices.js';
import type { GraphicsBackendName } from './graphics-ports.js';

export type GpuRendererFactory = ReturnType<typeof gpuRenderers>;

export function gpuRenderers(load: LoadGraphics, devices = new Devices()) {
  return {
    async create(
      backend: GraphicsBackendName,
      photograph: LoadedPhotograph,
      preferences: BackendPreferences,
      onLost: (reason: string) => void,
      signal: AbortSignal,
    ): Promise<Renderer> {
      const lease = await devices.lease(load, backend, preferences, onLost, signal);
      try {
        signal.throwIfAborted();
        const module = await load(backend);
        return await photograph.withModule(
          module,
          async (photo) => {
            const canvas = document.createElement('canvas');
            const relighter = await lease.graphics.draw(photo, canvas, preferences.gamut);
            return createModuleRenderer(module, photograph, relighter, canvas, lease);
          },
          { signal },
        );
      } catch (thrown) {
        lease.release();
        throw thrown;
      }
    },
    /** Opens a device. The returned function releases it. */
    async warmUp(
      backend: GraphicsBackendName,
      preferences: DevicePreferences,
      signal: AbortSignal,
    ): Promise<() => void> {
      return (await devices.lease(load, backend, preferences, () => {}, signal)).release;
    },
  };
}
