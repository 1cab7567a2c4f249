/** The core's photograph. Free of DOM types, because the package exports it. */

import type { PhotoInfo } from '../shared/value-types.js';

/** A photograph in memory, until it is freed. */
export interface CorePhotograph extends PhotoInfo {
  /** Frees its memory. */
  free(): void;
}
