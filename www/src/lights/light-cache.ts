/** Keeps the last light that was made in a WebAssembly module, for as long as its setting is unchanged. */

import type { Freeable, Light, ReceivedPhoto, RelightModule } from '../engine/types.js';
import { type PhotoError, toPhotoError } from '../shared/errors.js';
import { createBuiltinLight, type LightSetting } from './light-setting.js';

export interface LightResult {
  /** Owned by the cache. The same object as last time if and only if its content is unchanged. */
  readonly light: Light;
  /** Whether this is the requested light and not a substitute. */
  readonly lightApplied: boolean;
  /** The reason for a substitute; `null` also while an image is loading. */
  readonly lightError: PhotoError | null;
}

export class LightCache implements Freeable {
  readonly #module: Pick<RelightModule, 'Light'>;
  #light: Light | null = null;
  /** The setting of `#light`; `null` for an image, whose content may change. */
  #setting: LightSetting | null = null;

  constructor(module: Pick<RelightModule, 'Light'>) {
    this.#module = module;
  }

  /**
   * The light of a setting. While its image cannot be read, the last light substitutes for it, or, if there is
   * none, the built-in light.
   */
  get(setting: LightSetting, photo: ReceivedPhoto): LightResult {
    let lightApplied = true;
    let lightError: PhotoError | null = null;
    if (setting.image) {
      let light: Light | null = null;
      try {
        light = setting.image.createLight(this.#module, photo);
      } catch (thrown) {
        lightError = toPhotoError(thrown);
      }
      lightApplied = light !== null;
      if (light) this.#replace(light, null);
    }
    const isCurrent = setting.image !== null || setting === this.#setting;
    if (this.#light && isCurrent) return { light: this.#light, lightApplied, lightError };
    // Lights are large: free the old one before making the new one.
    this.free();
    const light = createBuiltinLight(this.#module, photo, setting);
    this.#replace(light, setting);
    return { light, lightApplied, lightError };
  }

  free(): void {
    this.#replace(null, null);
  }

  #replace(light: Light | null, setting: LightSetting | null): void {
    this.#light?.free();
    this.#light = light;
    this.#setting = setting;
  }
}
