/** What attributes, options and events call things. No DOM, as the core's types are made of it. */

/** The built-in lights, in the order menus show them. */
export const LIGHTS = ['flood', 'torch', 'checkerboard', 'stripes', 'spectrum', 'fire'] as const;

/** The name of a built-in light. */
export type LightName = (typeof LIGHTS)[number];

/** The name of a back end. */
export type Backend = 'webgpu' | 'webgl2' | 'cpu';

/** What a canvas can show: colours of sRGB, or those of Display P3 too. */
export type Gamut = 'srgb' | 'display-p3';

/** What becomes of brightness: cut off at white, or rolled off before it. */
export type ToneCurve = 'clip' | 'filmic';

/** The WebAssembly modules: one that decodes, and one for each back end. */
export type ModuleName = 'decoder' | Backend;

/** Those that the core is made of. */
export const CORE_MODULES = ['decoder', 'cpu'] as const satisfies readonly ModuleName[];
