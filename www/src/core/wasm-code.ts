/** Where the core has the code of its modules from: what it was given, files in Node, or else the network. */

import { fetchCode, type Provide } from '../engine/wasm-loader.js';
import type { ModuleName } from '../shared/names.js';

/** The code of a module: its bytes, or where they are. */
export type WasmCode = ArrayBuffer | ArrayBufferView<ArrayBuffer> | URL | string;

/** What of Node is used: not an import, which bundlers for pages would have to resolve. */
interface NodeProcess {
  getBuiltinModule?(
    name: 'node:fs/promises',
  ): { readFile(file: URL): Promise<Uint8Array> } | undefined;
}

const provided = new Map<ModuleName, WasmCode>();

/** Has a module started from this code, not from the file beside the script. One that runs stays. */
export function provideCode(name: ModuleName, code: WasmCode): void {
  provided.set(name, code);
}

/** The code of a module that would be at an address. */
export const coreCode: Provide = async (name, at) => {
  const code = provided.get(name) ?? at;
  if (typeof code !== 'string' && !(code instanceof URL)) return code;
  return (await readFile(String(code))) ?? (await fetchCode(name, code));
};

/** A file's bytes; `null` for other addresses, and where files cannot be read. */
export async function readFile(address: string): Promise<Uint8Array<ArrayBuffer> | null> {
  if (!address.startsWith('file:')) return null;
  const { process } = globalThis as { process?: NodeProcess };
  const files = process?.getBuiltinModule?.('node:fs/promises');
  return files ? new Uint8Array(await files.readFile(new URL(address))) : null;
}
