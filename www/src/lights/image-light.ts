/** An image that is used as light in place of a built-in light, as renderers see it. */

import type { Light, LivePicture, ReceivedPhoto, RelightModule } from '../engine/types.js';

/** An image that a graphics device can upload directly, and its size in pixels. */
export interface UploadableImage {
  readonly image: LivePicture;
  readonly width: number;
  readonly height: number;
}

/** Its content may change between frames. */
export interface ImageLight {
  uploadable(): UploadableImage | null;
  /**
   * The current content as a light of a WebAssembly module; `null` while nothing is loaded.
   *
   * @throws `light-tainted`, `light-size`, `light-value` or `light-source`
   */
  createLight(module: Pick<RelightModule, 'Light'>, photo: ReceivedPhoto): Light | null;
}

export const PENDING_IMAGE: ImageLight = { uploadable: () => null, createLight: () => null };
