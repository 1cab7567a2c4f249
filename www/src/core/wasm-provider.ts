/** Where the core gets its modules: from the caller, from files in Node, or from the network. */

import { type FetchWasm, fetchWasm } from '../engine/wasm-loader.js';
import { CORE_MODULES } from '../shared/keywords.js';

/** The name of a WebAssembly module. */
export type CoreModuleName = (typeof CORE_MODULES)[number];

/** A module's bytes, or their address. */
export type WasmInput = ArrayBuffer | ArrayBufferView<ArrayBuffer> | URL | string;

/** The part of Node that is used. An `import` would have to be resolved by bundlers for browsers. */
interface NodeProcess {
  getBuiltinModule?(
    name: 'node:fs/promises',
  ): { readFile(file: URL): Promise<Uint8Array> } | undefined;
}

const provided = new Map<string, WasmInput>();

/**
 * Sets the bytes or the addresses of WebAssembly modules, where the files beside the script can be neither fetched nor
 * read. They must be of this release. Call it before the first
 * `decode`. Code with SIMD needs a machine with SIMD.
 */
export function provideWasm(codes: Readonly<Partial<Record<CoreModuleName, WasmInput>>>): void {
  const known: readonly string[] = CORE_MODULES;
  for (const [name, code] of Object.entries(codes)) {
    if (!known.includes(name)) {
      throw new TypeError(
        `There is no module named “${name}”. Known modules: ${known.join(', ')}.`,
      );
    }
    if (code !== undefined) provided.set(name, code);
  }
}

export const fetchCoreWasm: FetchWasm = async (name, url, integrity) => {
  const code = provided.get(name) ?? url;
  if (typeof code !== 'string' && !(code instanceof URL)) return code;
  return (await readFile(String(code))) ?? (await fetchWasm(name, code, integrity));
};

/** A file's bytes; `null` if the URL is not a `file:` URL, or outside of Node. */
export async function readFile(url: string): Promise<Uint8Array<ArrayBuffer> | null> {
  if (!url.startsWith('file:')) return null;
  const { process } = globalThis as { process?: NodeProcess };
  const files = process?.getBuiltinModule?.('node:fs/promises');
  return files ? new Uint8Array(await files.readFile(new URL(url))) : null;
}
