/**
 * SHA-256 of each WebAssembly module, as in an `integrity` attribute. The bundle has the values of its modules in place
 * of these, which check nothing.
 */

export const capture_reader = '';
export const decoder = '';
export const decoder_scalar = '';
export const cpu = '';
export const cpu_scalar = '';
export const recovery = '';
export const webgl2 = '';
export const webgpu = '';
