/** What a photograph of the core is inside: apart from its face, whose types need no DOM. */

import type { Facts, Photograph } from '../photo/photograph.js';
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
    const facts: Facts = photograph.facts;
    this.width = facts.width;
    this.height = facts.height;
    this.lightWidth = facts.lightWidth;
    this.lightHeight = facts.lightHeight;
    this.decodedBytes = facts.decodedBytes;
    this.metadata = facts.metadata;
    this.photograph = photograph;
  }

  free(): void {
    if (this.#freed) return;
    this.#freed = true;
    this.onFree?.();
    this.photograph.free();
  }
}
