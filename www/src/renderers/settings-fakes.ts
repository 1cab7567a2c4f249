/** Settings for tests. */

import type { OutputSettings } from '../engine/output-settings.js';
import type { Backend } from '../engine/wasm-exports.js';
import type { BackendPreferences } from './types.js';

export const PLAIN: OutputSettings = { exposure: 1, whiteBalance: [1, 1, 1], tone: 'clip' };

export function withExposure(exposure: number): OutputSettings {
  return { ...PLAIN, exposure };
}

/** The options of a page that names its backends. */
export function withBackends(backends: readonly Backend[]): BackendPreferences {
  return { backends, software: true, gamut: 'srgb' };
}
