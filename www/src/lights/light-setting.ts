/** What shines on a photograph. */

import type { DrawingModule, DrawnPhoto, Light } from '../engine/types.js';
import { CENTRE, type LightName, type PicturePoint } from '../shared/settings.js';
import type { Projection } from './projection.js';

/** A built-in light; a torch may have been moved to a point of the picture. */
export interface BuiltinSetting {
  readonly name: LightName;
  readonly torch: PicturePoint | null;
  /** Radius of a torch, as a fraction of the light plane's shorter side; the usual one if left out. */
  readonly size?: number;
  /** How long a fire has burnt; not at all if left out. */
  readonly seconds?: number;
}

/** That, or in its place a picture, as soon as there is something of it to be seen. */
export interface LightSetting extends BuiltinSetting {
  readonly picture: Projection | null;
}

type LightMaker = Pick<DrawingModule, 'Light'>;

/** A built-in light in the module. */
export function builtinLight(
  { Light }: LightMaker,
  photo: DrawnPhoto,
  { name, torch, size, seconds = 0 }: BuiltinSetting,
): Light {
  if (name === 'fire') return Light.fire(photo, seconds);
  if (name === 'torch' && (torch || size !== undefined)) {
    const { x, y } = torch ?? CENTRE;
    return Light.torch(photo, x, y, size);
  }
  return Light.builtin(photo, name);
}
