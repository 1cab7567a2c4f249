/** What shines on a drawing: the light that was made last, kept for when the next one cannot be. */

import type { DrawingModule, DrawnPhoto, Freeable, Light } from '../engine/types.js';
import { type PhotoError, toPhotoError } from '../shared/errors.js';
import { type BuiltinSetting, builtinLight, type LightSetting } from './light-setting.js';

/** What a lamp was turned to. */
export interface Lit {
  /** Stays the lamp's. The same as the last time only where it is as it was then. */
  readonly light: Light;
  /** Whether it is the light that was asked for. */
  readonly asked: boolean;
  /** Why it is not the light that was asked for, where it should be. */
  readonly fault: PhotoError | null;
}

/** See the module. */
export class Lamp implements Freeable {
  readonly #module: Pick<DrawingModule, 'Light'>;
  #light: Light | null = null;
  /** What that is, where it is built in. */
  #builtin: BuiltinSetting | null = null;

  constructor(module: Pick<DrawingModule, 'Light'>) {
    this.#module = module;
  }

  /**
   * Turns to a light. Where that cannot be had, or shows nothing as yet, the last one stays; where there
   * is none, the built-in one stands in.
   */
  turnTo(setting: LightSetting, photo: DrawnPhoto): Lit {
    let asked = true;
    let fault: PhotoError | null = null;
    if (setting.picture) {
      let light: Light | null = null;
      try {
        light = setting.picture.light(this.#module, photo);
      } catch (thrown) {
        fault = toPhotoError(thrown);
      }
      asked = light !== null;
      if (light) this.#keep(light, null);
    }
    const builtin = this.#builtin && isSame(this.#builtin, setting);
    if (this.#light && (setting.picture || builtin)) return { light: this.#light, asked, fault };
    // Before it is made, as lights are large and it can be had.
    this.free();
    const light = builtinLight(this.#module, photo, setting);
    // Without a picture that it may stand in for.
    const { picture: _, ...builtinSetting } = setting;
    this.#keep(light, builtinSetting);
    return { light, asked, fault };
  }

  free(): void {
    this.#light?.free();
    this.#light = null;
    this.#builtin = null;
  }

  #keep(light: Light, builtin: BuiltinSetting | null): void {
    this.free();
    this.#light = light;
    this.#builtin = builtin;
  }
}

function isSame(a: BuiltinSetting, b: BuiltinSetting): boolean {
  return (
    a.name === b.name &&
    a.torch?.x === b.torch?.x &&
    a.torch?.y === b.torch?.y &&
    a.size === b.size &&
    a.seconds === b.seconds
  );
}
