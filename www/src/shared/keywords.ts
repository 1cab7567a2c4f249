/** Names that attributes, options and events use. Free of DOM types, because the core's types depend on it. */

/** The built-in lights, in the order of the light menu. */
export const LIGHTS = ['flood', 'torch', 'checkerboard', 'stripes', 'spectrum', 'fire'] as const;

export type LightName = (typeof LIGHTS)[number];

/** The backends from fastest to slowest, which is the order in which they are tried. */
export const BACKENDS: readonly [Backend, ...Backend[]] = ['webgpu', 'webgl2', 'cpu'];

export type Backend = 'webgpu' | 'webgl2' | 'cpu';

/** The colour space of the canvas. */
export type Gamut = 'srgb' | 'display-p3';

/** The CORS mode of requests, as on `<img>`. */
export type CrossOrigin = 'anonymous' | 'use-credentials' | null;

/** How brightness above white is shown: `clip` cuts it off, `filmic` compresses it. */
export type ToneCurve = 'clip' | 'filmic';

/** The WebAssembly modules: the decoder, one for each backend, recovery, and its reader of captures. */
export type WasmModuleName = 'decoder' | Backend | 'recovery' | 'capture_reader';

export const CORE_MODULES = ['decoder', 'cpu'] as const satisfies readonly WasmModuleName[];
