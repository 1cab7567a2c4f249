/** What shines on a photograph. */

import type { DrawingModule, DrawnPhoto, Light } from './engine.js';
import { pixelsOf } from './light-pixels.js';
import { isLinear, type LightPicture } from './light-source.js';
import type { LightName, PicturePoint } from './settings.js';

/** A built-in light; a torch may have been moved to a point of the picture. */
export interface BuiltinSetting {
  readonly name: LightName;
  readonly torch: PicturePoint | null;
}

/** That, or in its place a picture, as soon as there is something of it to be seen. */
export interface LightSetting extends BuiltinSetting {
  readonly picture: LightPicture | null;
}

type LightMaker = Pick<DrawingModule, 'Light'>;

/** A built-in light in the module. */
export function builtinLight(
  { Light }: LightMaker,
  photo: DrawnPhoto,
  { name, torch }: BuiltinSetting,
): Light {
  return name === 'torch' && torch
    ? Light.torch(photo, torch.x, torch.y)
    : Light.builtin(photo, name);
}

/**
 * What a picture shows now as light in the module; `null` while there is nothing of it to be seen. Throws
 * `light-…` where it cannot be light.
 */
export function pictureLight(
  { Light }: LightMaker,
  photo: DrawnPhoto,
  picture: LightPicture,
): Light | null {
  if (isLinear(picture)) {
    return Light.fromLinear(photo, picture.data, picture.width, picture.height);
  }
  const pixels = pixelsOf(picture);
  return pixels && Light.fromSrgb(photo, pixels.data, pixels.width, pixels.height);
}
