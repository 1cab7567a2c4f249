/** How WebAssembly modules are found and started. */

import type { ModuleName, Modules } from './engine.js';
import { messageOf, PhotoError } from './errors.js';

// The smallest module with a 128-bit operation: () => i8x16.splat(0), dropped.
const SIMD_PROBE = new Uint8Array([
  0, 97, 115, 109, 1, 0, 0, 0, 1, 4, 1, 96, 0, 0, 3, 2, 1, 0, 10, 9, 1, 7, 0, 65, 0, 253, 15, 26,
  11,
]);

/** Where the modules are, if not beside this script: an address that ends in a slash. */
let folder: string | null = null;
const loading = new Map<ModuleName, Promise<unknown>>();

/** Has modules loaded from another folder from now on. What has been loaded stays. */
export function setModuleFolder(address: string | null): void {
  folder = address;
}

/** That folder, for workers. */
export function moduleFolder(): string | null {
  return folder;
}

/** A module, loaded once a page; a load that failed is tried again at the next call. */
export function loadModule<N extends ModuleName>(name: N): Promise<Modules[N]> {
  const known = loading.get(name) as Promise<Modules[N]> | undefined;
  if (known) return known;
  const started = start<Modules[N]>(name).catch((cause: unknown) => {
    loading.delete(name);
    throw new PhotoError(
      'wasm-unavailable',
      `The module that ${PURPOSES[name]} could not be started. The wasm folder has to lie beside the ` +
        "script, or where wasm-url says, and a content security policy has to allow 'wasm-unsafe-eval' " +
        "in script-src, and the folder's address in connect-src. " +
        `The browser says: ${messageOf(cause)}`,
      cause,
    );
  });
  loading.set(name, started);
  return started;
}

const PURPOSES: Readonly<Record<ModuleName, string>> = {
  decoder: 'decodes photographs',
  cpu: 'relights on the CPU',
  webgl2: 'relights by WebGL2',
  webgpu: 'relights by WebGPU',
};

/** What wasm-bindgen makes. */
interface Glue {
  default(options: { module_or_path: Promise<Response> }): Promise<unknown>;
}

async function start<M>(name: ModuleName): Promise<M> {
  const [script, wasm] = addresses(name);
  // Both at once: each is of no use without the other.
  const bytes = fetch(wasm);
  bytes.catch(() => {});
  const glue: Glue = await import(/* @vite-ignore */ /* webpackIgnore: true */ script);
  await glue.default({ module_or_path: bytes });
  return glue as M;
}

function addresses(name: ModuleName): [script: string, wasm: string] {
  // A build with SIMD does not even load where SIMD is missing. Graphics devices need none.
  const scalar =
    (name === 'decoder' || name === 'cpu') && !WebAssembly.validate(SIMD_PROBE) ? '_scalar' : '';
  if (folder !== null) {
    return [`${folder}${name}${scalar}.js`, `${folder}${name}${scalar}_bg.wasm`];
  }
  // Written out for bundlers, which look for exactly this form.
  const [script, wasm] = {
    decoder: () => [
      new URL('./wasm/decoder.js', import.meta.url),
      new URL('./wasm/decoder_bg.wasm', import.meta.url),
    ],
    decoder_scalar: () => [
      new URL('./wasm/decoder_scalar.js', import.meta.url),
      new URL('./wasm/decoder_scalar_bg.wasm', import.meta.url),
    ],
    cpu: () => [
      new URL('./wasm/cpu.js', import.meta.url),
      new URL('./wasm/cpu_bg.wasm', import.meta.url),
    ],
    cpu_scalar: () => [
      new URL('./wasm/cpu_scalar.js', import.meta.url),
      new URL('./wasm/cpu_scalar_bg.wasm', import.meta.url),
    ],
    webgl2: () => [
      new URL('./wasm/webgl2.js', import.meta.url),
      new URL('./wasm/webgl2_bg.wasm', import.meta.url),
    ],
    webgpu: () => [
      new URL('./wasm/webgpu.js', import.meta.url),
      new URL('./wasm/webgpu_bg.wasm', import.meta.url),
    ],
  }[`${name}${scalar}` as ModuleName]() as [URL, URL];
  return [script.href, wasm.href];
}
