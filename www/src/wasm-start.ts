/** How a WebAssembly module is found and started, in pages, in workers and in Node. */

/** The code of a module: its bytes, or where they are. */
export type WasmCode = ArrayBuffer | ArrayBufferView<ArrayBuffer> | URL | string;

/** A module that comes in two builds, with one script for both. */
export interface WasmBuilds {
  /** What pages call it that have its code. */
  readonly name: string;
  /** The script that wasm-bindgen makes. */
  readonly glue: () => Promise<unknown>;
  readonly simd: () => URL;
  readonly scalar: () => URL;
}

/** What wasm-bindgen makes. */
interface Glue {
  default(options: { module_or_path: BufferSource | Response }): Promise<unknown>;
}

/** What of Node is used: not an import, which bundlers for pages would have to resolve. */
interface NodeProcess {
  getBuiltinModule?(
    name: 'node:fs/promises',
  ): { readFile(file: URL): Promise<Uint8Array> } | undefined;
}

// The smallest module with a 128-bit operation: () => i8x16.splat(0), dropped.
const SIMD_PROBE = new Uint8Array([
  0, 97, 115, 109, 1, 0, 0, 0, 1, 4, 1, 96, 0, 0, 3, 2, 1, 0, 10, 9, 1, 7, 0, 65, 0, 253, 15, 26,
  11,
]);

const provided = new Map<string, WasmCode>();

/** Has a module started from this code, not from the file beside the script. One that runs stays. */
export function provideCode(name: string, code: WasmCode): void {
  provided.set(name, code);
}

/** Starts a module, in the build that this machine can run. */
export async function startWasm({ name, glue, simd, scalar }: WasmBuilds): Promise<unknown> {
  // A build with SIMD does not even load where SIMD is missing.
  const code = provided.get(name) ?? (WebAssembly.validate(SIMD_PROBE) ? simd() : scalar());
  // Both at once: each is of no use without the other.
  const bytes = bytesOf(code);
  bytes.catch(() => {});
  const module = (await glue()) as Glue;
  await module.default({ module_or_path: await bytes });
  return module;
}

async function bytesOf(code: WasmCode): Promise<BufferSource | Response> {
  if (typeof code !== 'string' && !(code instanceof URL)) return code;
  return (await readFile(String(code))) ?? (await fetch(code));
}

/** A file's bytes; `null` for other addresses, and where files cannot be read. */
export async function readFile(address: string): Promise<Uint8Array<ArrayBuffer> | null> {
  if (!address.startsWith('file:')) return null;
  const { process } = globalThis as { process?: NodeProcess };
  const files = process?.getBuiltinModule?.('node:fs/promises');
  return files ? new Uint8Array(await files.readFile(new URL(address))) : null;
}
