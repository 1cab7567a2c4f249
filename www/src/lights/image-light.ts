/** A picture that shines. */

import type { DrawingModule, DrawnPhoto, Light } from '../engine/types.js';
import { pixelsOf, sizeOf } from './light-pixels.js';
import { isLinear, isLive, type LightPicture } from './light-source.js';
import type { Live, Projection } from './projection.js';

/** See the module. */
export class Projected implements Projection {
  readonly #picture: LightPicture;

  constructor(picture: LightPicture) {
    this.#picture = picture;
  }

  live(): Live | null {
    const picture = this.#picture;
    const size = isLive(picture) ? sizeOf(picture) : null;
    if (!isLive(picture) || !size || size.width === 0 || size.height === 0) return null;
    return { picture, width: size.width, height: size.height };
  }

  light({ Light }: Pick<DrawingModule, 'Light'>, photo: DrawnPhoto): Light | null {
    const picture = this.#picture;
    if (isLinear(picture)) {
      return Light.fromLinear(photo, picture.data, picture.width, picture.height);
    }
    const pixels = pixelsOf(picture);
    return pixels && Light.fromSrgb(photo, pixels.data, pixels.width, pixels.height);
  }
}
