/** A backend in use for one photograph, and the photograph's reference count. */

import type { Backend, Freeable } from '../engine/wasm-exports.js';
import type { LoadedPhotograph } from '../photo/photograph.js';
import type { BackendPreferences, Renderer } from '../renderers/types.js';
import type { Deferred } from '../shared/promises.js';
import { QualityController } from './quality-controller.js';

/** An object that is freed when its last user releases it. The creator is its first user. */
export class RefCounted<T extends Freeable> {
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

export class ActiveBackend {
  /** For this renderer alone: frame times of other renderers say nothing about it. */
  readonly qualityController = new QualityController();
  hasDrawn = false;
  /** Why the backend stopped working; `null` while it works. */
  lossReason: string | null = null;
  /** Resolves when the frame in progress ends; `null` if there is none. */
  frame: Deferred | null = null;
  isFreed = false;

  constructor(
    readonly backend: Backend,
    readonly options: BackendPreferences,
    readonly renderer: Renderer,
    readonly photo: RefCounted<LoadedPhotograph>,
  ) {
    photo.retain();
  }

  free(): void {
    if (this.isFreed) return;
    this.isFreed = true;
    this.renderer.free();
    this.photo.release();
  }
}
