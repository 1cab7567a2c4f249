/** What shines on a drawing: the light that was made last, kept for when the next one cannot be. */

import type { Engine, Freeable, Light, Photo } from './engine.js';
import { type PhotoError, toPhotoError } from './errors.js';
import { builtinLight, type LightSetting, pictureLight } from './lights.js';

/** What a lamp was turned to. */
export interface Lit {
  /** Stays the lamp's. */
  readonly light: Light;
  /** Whether it is the light that was asked for. */
  readonly asked: boolean;
  /** Why it is not the light that was asked for, where it should be. */
  readonly fault: PhotoError | null;
}

/** See the module. */
export class Lamp implements Freeable {
  readonly #engine: Pick<Engine, 'Light'>;
  #light: Light | null = null;

  constructor(engine: Pick<Engine, 'Light'>) {
    this.#engine = engine;
  }

  /**
   * Turns to a light. Where that cannot be had, or shows nothing as yet, the last one stays; where there
   * is none, the built-in one stands in.
   */
  turnTo(setting: LightSetting, photo: Photo): Lit {
    let light: Light | null = null;
    let asked = true;
    let fault: PhotoError | null = null;
    if (setting.picture) {
      try {
        light = pictureLight(this.#engine, photo, setting.picture);
      } catch (thrown) {
        fault = toPhotoError(thrown);
      }
      asked = light !== null;
      light ??= this.#light;
    }
    light ??= builtinLight(this.#engine, photo, setting);
    if (light !== this.#light) this.free();
    this.#light = light;
    return { light, asked, fault };
  }

  free(): void {
    this.#light?.free();
    this.#light = null;
  }
}
