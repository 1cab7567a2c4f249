/** How WebAssembly modules are found and started, in pages, in workers and in Node. */

import { messageOf, PhotoError } from '../shared/errors.js';
import type { ModuleName } from '../shared/names.js';
import { allowed } from '../shared/policy.js';

/** Bytes of WebAssembly, or the answer that brings them. */
type Code = ArrayBuffer | ArrayBufferView<ArrayBuffer> | Response;

/** Gives the code of a module that is at an address. */
export type Provide = (name: ModuleName, at: URL | string) => Promise<Code>;

export const fetchCode: Provide = (_, at) => fetch(at);

/** Where a module is: written out for bundlers, which look for exactly such forms. */
export interface WasmBuilds {
  /** The script that wasm-bindgen makes, one for both builds. */
  readonly glue: () => Promise<unknown>;
  readonly simd: () => URL;
  /** For machines without SIMD; left out where there is one build for all. */
  readonly scalar?: () => URL;
}

/** What wasm-bindgen makes. */
interface Glue {
  default(options: { module_or_path: Code }): Promise<unknown>;
}

// The smallest module with a 128-bit operation: () => i8x16.splat(0), dropped.
const SIMD_PROBE = new Uint8Array([
  0, 97, 115, 109, 1, 0, 0, 0, 1, 4, 1, 96, 0, 0, 3, 2, 1, 0, 10, 9, 1, 7, 0, 65, 0, 253, 15, 26,
  11,
]);

/** Where modules are, if not beside this script: an address that ends in a slash. */
let folder: string | null = null;

/** Has modules started from files in another folder from now on. Those that run stay. */
export function setModuleFolder(address: string | null): void {
  folder = address;
}

/** That folder, for workers. */
export function moduleFolder(): string | null {
  return folder;
}

/**
 * How a module is loaded, once a page; a load that failed is tried again at the next call. `what` says what
 * the module does.
 */
export function loader<M>(
  name: ModuleName,
  what: string,
  builds: WasmBuilds,
): (provide?: Provide) => Promise<M> {
  let loading: Promise<M> | undefined;
  return (provide = fetchCode) => {
    loading ??= allowed(() => start<M>(name, builds, provide), /^script-src/, mayNotRun).catch(
      (cause: unknown) => {
        loading = undefined;
        if (cause instanceof PhotoError) throw cause;
        throw new PhotoError(
          'wasm-unavailable',
          `The module that ${what} could not be started. The wasm folder has to lie beside the script, or ` +
            'where wasm-url says, and a content security policy has to allow its address in connect-src. ' +
            `The browser says: ${messageOf(cause)}`,
          cause,
        );
      },
    );
    return loading;
  };
}

function mayNotRun(_: string, cause: unknown): PhotoError {
  return new PhotoError(
    'csp-wasm',
    "WebAssembly may not run here: the page's content security policy has to allow " +
      "'wasm-unsafe-eval' in script-src.",
    cause,
  );
}

/** Starts a module, in the build that this machine can run. */
async function start<M>(
  name: ModuleName,
  { glue, simd, scalar }: WasmBuilds,
  provide: Provide,
): Promise<M> {
  // A build with SIMD does not even load where SIMD is missing.
  const old = scalar && !WebAssembly.validate(SIMD_PROBE) ? scalar : null;
  const beside = old ?? simd;
  const at = folder === null ? beside() : `${folder}${name}${old ? '_scalar' : ''}_bg.wasm`;
  // Both at once: each is of no use without the other.
  const bytes = provide(name, at);
  bytes.catch(() => {});
  const module = (await glue()) as Glue;
  await module.default({ module_or_path: await bytes });
  return module as M;
}
