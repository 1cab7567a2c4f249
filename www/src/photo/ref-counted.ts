/** An object with several users, which is freed when the last of them releases it. */

import type { Freeable } from '../engine/wasm-exports.js';

export class RefCounted<T extends Freeable> {
  /** The creator is the first. */
  #users = 1;

  constructor(readonly value: T) {}

  retain(): void {
    this.#users += 1;
  }

  release(): void {
    this.#users -= 1;
    if (this.#users === 0) this.value.free();
  }
}
