/** What the browser says about its graphics devices before a module is loaded for them. */

import type { Backend } from '../../engine/wasm-exports.js';

/** A backend that draws with a graphics device. */
export type GraphicsBackendName = Exclude<Backend, 'cpu'>;

/** The page's graphics; tests replace them. */
export interface GraphicsPorts {
  /** The name of the adapter that the browser would use; `null` if there is none. */
  nameOf(backend: GraphicsBackendName): Promise<string | null>;
  createCanvas(): HTMLCanvasElement;
  /** Milliseconds, from any start. */
  now(): number;
}

export const BROWSER_GRAPHICS: GraphicsPorts = {
  nameOf: async (backend) => (backend === 'webgpu' ? webGpuName() : webGl2Name()),
  createCanvas: () => document.createElement('canvas'),
  now: () => performance.now(),
};

async function webGpuName(): Promise<string | null> {
  const adapter = await navigator.gpu?.requestAdapter();
  if (!adapter) return null;
  const { vendor, architecture, description, isFallbackAdapter } = adapter.info ?? {};
  return [vendor, architecture, description, isFallbackAdapter ? 'software' : ''].join(' ').trim();
}

function webGl2Name(): string | null {
  const gl = document.createElement('canvas').getContext('webgl2');
  if (!gl) return null;
  let name: string | null = gl.getParameter(gl.RENDERER);
  // Chrome and Safari tell the name only by this extension; Firefox warns about its use.
  if (name?.startsWith('WebKit')) {
    const info = gl.getExtension('WEBGL_debug_renderer_info');
    if (info) name = gl.getParameter(info.UNMASKED_RENDERER_WEBGL);
  }
  // Frees the context: a page may have only a few.
  gl.getExtension('WEBGL_lose_context')?.loseContext();
  return name;
}
