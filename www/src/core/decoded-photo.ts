/** What a photograph of the core is inside: apart from its face, whose types need no DOM. */

import type { Photograph, PhotoInfo } from '../photo/photograph.js';
import type { CorePhotograph } from './decode.js';

/** See the module. */
export class DecodedPhotograph implements CorePhotograph {
  readonly width: number;
  readonly height: number;
  readonly lightWidth: number;
  readonly lightHeight: number;
  readonly decodedBytes: number;
  readonly metadata: unknown;
  readonly photograph: Photograph;
  /** Told before it is freed. */
  onFree: (() => void) | null = null;
  #freed = false;

  constructor(photograph: Photograph) {
    const info: PhotoInfo = photograph.info;
    this.width = info.width;
    this.height = info.height;
    this.lightWidth = info.lightWidth;
    this.lightHeight = info.lightHeight;
    this.decodedBytes = info.decodedBytes;
    this.metadata = info.metadata;
    this.photograph = photograph;
  }

  free(): void {
    if (this.#freed) return;
    this.#freed = true;
    this.onFree?.();
    this.photograph.free();
  }
}
