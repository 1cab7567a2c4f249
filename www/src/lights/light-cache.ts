/** Keeps the last light that was made in a WebAssembly module, for as long as its setting is unchanged. */

import type { Freeable, ImportedPhoto, Light, RelightModule } from '../engine/wasm-exports.js';
import { type PhotoError, toPhotoError } from '../shared/errors.js';
import type { PicturePoint } from '../shared/value-types.js';
import { type CameraColors, cameraLightConverter, type LightConverter } from './camera-light.js';
import { createBuiltinLight, type LightSetting } from './light-setting.js';

/** Whether a frame has the requested light. */
export interface AppliedLightStatus {
  /** False if the frame shows the last light, because the requested one has no picture (yet). */
  readonly lightApplied: boolean;
  /** Why the requested light is unavailable; `null` if it is not, or is only loading. */
  readonly lightError: PhotoError | null;
}

/** A photograph that lights are made for. */
export interface LitPhotograph extends CameraColors {
  /** A photograph without tiles in a module. */
  createLightPlane(module: RelightModule): ImportedPhoto;
  /** For a shard, as `LoadedPhotograph` has it. */
  readonly root?: { readonly photograph: LitPhotograph; readonly scale: number } | null;
}

export class LightCache implements Freeable {
  #light: Light | null = null;
  /** The setting of `#light`; `null` for an image, whose content may change. */
  #setting: LightSetting | null = null;

  /** `lightPlane` is a photograph without tiles, which is freed with the cache. */
  constructor(
    private readonly module: Pick<RelightModule, 'Light'>,
    private readonly lightPlane: ImportedPhoto,
    private readonly convert: LightConverter = (light) => light,
    /** The photograph whose picture the torch's position is on, freed with the cache; and its scale. */
    private readonly picture: ImportedPhoto = lightPlane,
    private readonly scale = 1,
  ) {}

  /** A cache of lights for a photograph. */
  static of(module: RelightModule, photograph: LitPhotograph): LightCache {
    const lightPlane = photograph.createLightPlane(module);
    const convert = cameraLightConverter(module, lightPlane, photograph);
    const { root } = photograph;
    if (!root) return new LightCache(module, lightPlane, convert);
    const picture = root.photograph.createLightPlane(module);
    return new LightCache(module, lightPlane, convert, picture, root.scale);
  }

  /**
   * The light of a frame, owned by the cache: the same object as last time if and only if its content is unchanged.
   * While a setting's image cannot be read, the last light replaces it, or, if there is none, the built-in light.
   */
  get(setting: LightSetting): AppliedLightStatus & { readonly light: Light } {
    let lightApplied = true;
    let lightError: PhotoError | null = null;
    if (setting.image) {
      let light: Light | null = null;
      try {
        light = setting.image.createLight(this.module, this.lightPlane);
        light = light && this.convert(light);
      } catch (thrown) {
        lightError = toPhotoError(thrown);
      }
      lightApplied = light !== null;
      if (light) this.#replace(light, null);
    }
    const isCurrent = setting.image !== null || setting === this.#setting;
    if (this.#light && isCurrent) return { light: this.#light, lightApplied, lightError };
    // Lights are large: free the old one before making the new one.
    this.#replace(null, null);
    const behind = ({ x, y }: PicturePoint): [number, number] => {
      const [u = 0, v = 0] = this.picture.behind(x, y);
      return [u * this.scale, v * this.scale];
    };
    const light = this.convert(createBuiltinLight(this.module, this.lightPlane, setting, behind));
    this.#replace(light, setting);
    return { light, lightApplied, lightError };
  }

  free(): void {
    this.#replace(null, null);
    this.lightPlane.free();
    if (this.picture !== this.lightPlane) this.picture.free();
  }

  #replace(light: Light | null, setting: LightSetting | null): void {
    this.#light?.free();
    this.#light = light;
    this.#setting = setting;
  }
}
