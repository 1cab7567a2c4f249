/** The class behind `CorePhotograph`. */

import type { Photograph } from '../photo/photograph.js';
import type { CorePhotograph } from './types.js';

export class DecodedPhotograph implements CorePhotograph {
  readonly width: number;
  readonly height: number;
  readonly lightWidth: number;
  readonly lightHeight: number;
  readonly decodedBytes: number;
  readonly metadata: unknown;
  /** Called before the photograph is freed. */
  onFree: (() => void) | null = null;
  #isFreed = false;

  constructor(readonly photograph: Photograph) {
    const { width, height, lightWidth, lightHeight, decodedBytes, metadata } = photograph.info;
    this.width = width;
    this.height = height;
    this.lightWidth = lightWidth;
    this.lightHeight = lightHeight;
    this.decodedBytes = decodedBytes;
    this.metadata = metadata;
  }

  free(): void {
    if (this.#isFreed) return;
    this.#isFreed = true;
    this.onFree?.();
    this.photograph.free();
  }
}
