/** The class behind `CorePhotograph`. */

import type { Photograph } from '../photo/photograph.js';
import type { PhotoInfo } from '../shared/photo-info.js';
import type { CorePhotograph } from './types.js';

export interface DecodedPhotograph extends PhotoInfo {}

// biome-ignore lint/suspicious/noUnsafeDeclarationMerging: the constructor assigns the interface's properties
export class DecodedPhotograph implements CorePhotograph {
  /** Called before the photograph is freed. */
  onFree: (() => void) | null = null;
  #isFreed = false;

  constructor(readonly photograph: Photograph) {
    Object.assign(this, photograph.info);
  }

  free(): void {
    if (this.#isFreed) return;
    this.#isFreed = true;
    this.onFree?.();
    this.photograph.free();
  }
}
