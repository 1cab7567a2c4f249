/** Finds, fetches and starts WebAssembly modules in pages, in workers and in Node. */

import { withPolicyErrors } from '../shared/content-security-policy.js';
import { messageOf, PhotoError } from '../shared/errors.js';
import type { WasmModuleName } from '../shared/keywords.js';

/** The bytes of a module, or the response that brings them. */
type WasmSource = ArrayBuffer | ArrayBufferView<ArrayBuffer> | Response;

/** Gets the module with the given name, whose file is at `url` and has the hash `integrity`. */
export type FetchWasm = (
  name: WasmModuleName,
  url: URL | string,
  integrity: string,
) => Promise<WasmSource>;

export const fetchWasm: FetchWasm = (_, url, integrity) => fetch(url, { integrity });

/** A module's files. Functions, because bundlers recognise only literal paths. */
export interface WasmBuilds {
  /** The script of wasm-bindgen, which all builds share; its default export starts the module. */
  readonly glue: () => Promise<{
    default(options: { module_or_path: WasmSource }): Promise<unknown>;
  }>;
  readonly simd: () => URL;
  /** The build for machines without SIMD; absent if one build runs everywhere. */
  readonly scalar?: () => URL;
  /** The hashes of the two builds. */
  readonly integrity: readonly [simd: string, scalar?: string];
}

// The smallest module with a 128-bit operation: () => i8x16.splat(0), dropped.
const SIMD_PROBE = new Uint8Array([
  0, 97, 115, 109, 1, 0, 0, 0, 1, 4, 1, 96, 0, 0, 3, 2, 1, 0, 10, 9, 1, 7, 0, 65, 0, 253, 15, 26,
  11,
]);

export function hasSimd(): boolean {
  return WebAssembly.validate(SIMD_PROBE);
}

/** The folder of the modules, with a slash at its end; `null` if they lie beside this script. */
export let moduleFolder: string | null = null;

/** The absolute address of a folder. */
export function toModuleFolder(url: string | URL): string {
  return new URL(url, globalThis.document?.baseURI).href;
}

/** Sets the folder of modules that are started from now on, with or without a slash at its end. */
export function setModuleFolder(url: string | null): void {
  moduleFolder = url?.replace(/\/?$/, '/') ?? null;
}

/** Loads a module once per page, and again after a failure. `task`, for error messages, says what the module does. */
export function createLoader<Module>(
  name: WasmModuleName,
  task: string,
  builds: WasmBuilds,
): (fetchModule?: FetchWasm) => Promise<Module> {
  let loading: Promise<Module> | undefined;
  return (fetchModule = fetchWasm) => {
    const start = () => startModule<Module>(name, builds, fetchModule);
    loading ??= withPolicyErrors(start, /^script-src/, wasmForbidden).catch((cause: unknown) => {
      loading = undefined;
      if (cause instanceof PhotoError) throw cause;
      const message =
        `The module that ${task} could not be started. The wasm folder must be of the same release as the script ` +
        'and lie beside it or where wasmUrl says, and a content security policy must allow it in connect-src. ' +
        `The browser says: ${messageOf(cause)}`;
      throw new PhotoError('wasm-unavailable', message, cause);
    });
    return loading;
  };
}

function wasmForbidden(_: string, cause: unknown): PhotoError {
  const message =
    "The page's content security policy blocks WebAssembly: add 'wasm-unsafe-eval' to script-src.";
  return new PhotoError('csp-wasm', message, cause);
}

async function startModule<Module>(
  name: WasmModuleName,
  { glue, simd, scalar, integrity }: WasmBuilds,
  fetchModule: FetchWasm,
): Promise<Module> {
  // Without SIMD support, a SIMD build does not even compile.
  const scalarBuild = scalar && !hasSimd() ? scalar : null;
  const url =
    moduleFolder === null
      ? (scalarBuild ?? simd)()
      : `${moduleFolder}${name}${scalarBuild ? '_scalar' : ''}_bg.wasm`;
  // The module and its script load at the same time.
  const source = fetchModule(name, url, integrity[scalarBuild ? 1 : 0] ?? '');
  source.catch(() => {});
  const module = await glue();
  await module.default({ module_or_path: await source });
  return module as unknown as Module;
}
