/** What shines in the place of a built-in light, as drawings take it. */

import type { DrawingModule, DrawnPhoto, Light } from '../engine/types.js';
import type { LivePicture } from './light-source.js';

/** A picture that a device takes as it is, of so many pixels. */
export interface Live {
  readonly picture: LivePicture;
  readonly width: number;
  readonly height: number;
}

/** See the module. Shows something else at any time. */
export interface Projection {
  /** What it shows now, where that can be given to a device. */
  live(): Live | null;
  /**
   * What it shows now as light in a module; `null` while there is nothing of it to be seen. Throws `light-…`
   * where it cannot be light.
   */
  light(maker: Pick<DrawingModule, 'Light'>, photo: DrawnPhoto): Light | null;
}

/** One of which nothing is to be seen as yet. */
export const UNSEEN: Projection = { live: () => null, light: () => null };
