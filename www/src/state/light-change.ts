/** When a light is another than was told last. A source is one once it has been drawn. */

import type { LightSetting } from '../lights/light-setting.js';
import type { LightSource } from '../lights/light-source.js';
import type { LightName } from '../shared/names.js';
import type { PicturePoint } from '../shared/values.js';

/** What shines, as it is told. */
export interface Shining {
  /** The built-in light, or the one that a source stands in for. */
  readonly name: LightName;
  /** `null` in the middle, and for other lights. */
  readonly torch: PicturePoint | null;
  readonly source: LightSource | null;
}

/** See the module. */
export class LightNews {
  #told: Shining | null = null;

  /** What is new, if anything is. */
  asked({ name, torch, image }: LightSetting): Shining | null {
    // The first light is what the page asks for, which is no news.
    if (this.#told && image) return null;
    return this.#tell({ name, torch: image ? null : torch, source: null });
  }

  drawn(name: LightName, source: LightSource): Shining | null {
    return this.#tell({ name, torch: null, source });
  }

  #tell(now: Shining): Shining | null {
    const before = this.#told;
    this.#told = now;
    return before && !same(before, now) ? now : null;
  }
}

/** Under a source, built-in lights do not shine. */
function same(a: Shining, b: Shining): boolean {
  if (a.source || b.source) return a.source === b.source;
  return a.name === b.name && a.torch?.x === b.torch?.x && a.torch?.y === b.torch?.y;
}
