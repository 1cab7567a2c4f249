/** Settings that tests share. */

import type { OutputSettings } from '../engine/output-settings.js';
import type { Backend } from '../engine/types.js';
import type { RenderOptions } from '../renderers/types.js';

/** A photograph shown as taken. */
export const PLAIN: OutputSettings = { exposure: 1, whiteBalance: [1, 1, 1], tone: 'clip' };

export function exposed(exposure: number): OutputSettings {
  return { ...PLAIN, exposure };
}

/** Back ends that were named. */
export function wanting(backends: readonly Backend[]): RenderOptions {
  return { backends, software: true, gamut: 'srgb' };
}
