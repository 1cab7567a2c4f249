/** Settings that tests share. */

import type { Backend } from './engine.js';
import type { Look } from './look.js';
import type { Wanted } from './player.js';

/** A photograph shown as taken. */
export const PLAIN: Look = { exposure: 1, whiteBalance: [1, 1, 1], tone: 'clip' };

export function exposed(exposure: number): Look {
  return { ...PLAIN, exposure };
}

/** Back ends that were named. */
export function wanting(backends: readonly Backend[]): Wanted {
  return { backends, software: true, gamut: 'srgb' };
}
