/** The light of one frame. Immutable: a change makes a new object. */

import type {
  ExternalImageSource,
  ImportedPhoto,
  Light,
  RelightModule,
} from '../engine/wasm-exports.js';
import type { LightName } from '../shared/keywords.js';
import { CENTRE, type PicturePoint } from '../shared/value-types.js';

export interface LightSetting {
  readonly name: LightName;
  /** The torch's position; `null` behind the centre of the picture, and for other lights. */
  readonly torch: PicturePoint | null;
  /** The torch's radius in units of the light plane's shorter side; the module's default if absent. */
  readonly size?: number;
  /** The fire's time since it was lit, in seconds; 0 if absent. */
  readonly seconds?: number;
  /** Replaces the built-in light as soon as it is loaded. */
  readonly image: ImageLight | null;
}

/** An image that is used as light in place of a built-in light. Its content may change between frames. */
export interface ImageLight {
  /** The current content and its size in pixels, if a graphics device can upload it directly. */
  uploadable(): {
    readonly image: ExternalImageSource;
    readonly width: number;
    readonly height: number;
  } | null;
  /** `null` while nothing is loaded. Throws `light-tainted`, `light-size`, `light-value` or `light-source`. */
  createLight(module: Pick<RelightModule, 'Light'>, photo: ImportedPhoto): Light | null;
}

export const PENDING_IMAGE: ImageLight = { uploadable: () => null, createLight: () => null };

/** `behind` gives the position on the light plane behind a point of the picture, in light elements. */
export function createBuiltinLight(
  { Light }: Pick<RelightModule, 'Light'>,
  photo: ImportedPhoto,
  { name, torch, size, seconds = 0 }: LightSetting,
  behind: (point: PicturePoint) => readonly [u: number, v: number],
): Light {
  if (name === 'fire') return Light.fire(photo, seconds);
  if (name === 'torch' && (torch || size !== undefined)) {
    return Light.torch(photo, ...behind(torch ?? CENTRE), size);
  }
  return Light.builtin(photo, name);
}
