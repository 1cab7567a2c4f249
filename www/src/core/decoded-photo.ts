/** The class behind `CorePhotograph`. */

import type { RowRangeRelighter } from '../engine/wasm-exports.js';
import type { LoadedPhotograph } from '../photo/photograph.js';
import type { PhotoInfo } from '../shared/value-types.js';
import type { CorePhotograph } from './core-photograph.js';

export interface LtmPhotograph extends PhotoInfo {}

// biome-ignore lint/suspicious/noUnsafeDeclarationMerging: the constructor assigns the interface's properties
export class LtmPhotograph implements CorePhotograph {
  /** Made for the first picture. */
  relighter: RowRangeRelighter | null = null;
  #isFreed = false;

  constructor(readonly photograph: LoadedPhotograph) {
    // Of a file of several levels it is the last one.
    const { width, height, lightWidth, lightHeight } = photograph.descriptor;
    Object.assign(this, photograph.info, { width, height, lightWidth, lightHeight });
  }

  free(): void {
    if (this.#isFreed) return;
    this.#isFreed = true;
    this.relighter?.free();
    this.photograph.free();
  }
}
