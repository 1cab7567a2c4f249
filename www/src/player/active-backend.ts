/** A backend in use for one photograph. */

import type { Backend } from '../engine/wasm-exports.js';
import type { SharedPhoto } from '../photo/photo-library.js';
import type { BackendPreferences, Renderer } from '../renderers/types.js';
import type { Deferred } from '../shared/promises.js';

export class ActiveBackend {
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
    readonly photo: SharedPhoto,
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
