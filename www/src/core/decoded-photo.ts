/** The class behind `CorePhotograph`. */

import type { RowRangeRelighter } from '../engine/types.js';
import type { Photograph } from '../photo/photograph.js';
import type { PhotoInfo } from '../shared/value-types.js';
import type { CorePhotograph } from './types.js';

export interface LtmPhotograph extends PhotoInfo {}

// biome-ignore lint/suspicious/noUnsafeDeclarationMerging: the constructor assigns the interface's properties
export class LtmPhotograph implements CorePhotograph {
  /** Made for the first picture. */
  relighter: RowRangeRelighter | null = null;
  #isFreed = false;

  constructor(readonly photograph: Photograph) {
    Object.assign(this, photograph.info);
  }

  free(): void {
    if (this.#isFreed) return;
    this.#isFreed = true;
    this.relighter?.free();
    this.photograph.free();
  }
}
