/**
 * Detects when the photograph is drawn with another light, for the `lightchange` event. A source counts from its first
 * drawn frame. While a source is active, only another source is a change.
 */

import type { LightSetting } from '../lights/light-setting.js';
import type { LightSource } from '../lights/light-source.js';
import type { LightName } from '../shared/keywords.js';
import { reuse } from '../shared/reuse-if-equal.js';
import type { PicturePoint } from '../shared/value-types.js';

/** As in a `lightchange` event. */
export interface ActiveLight {
  readonly name: LightName;
  readonly torch: PicturePoint | null;
  readonly source: LightSource | null;
}

export class ActiveLightTracker {
  #active: ActiveLight | null = null;

  /** A setting was requested. The new light, if it is another built-in light. */
  requested({ name, torch, image }: LightSetting): ActiveLight | null {
    if (this.#active && image) return null;
    return this.#update({ name, torch: image ? null : torch, source: null });
  }

  /** A frame was drawn with a source. The new light, if it is another source. */
  drawn(name: LightName, source: LightSource): ActiveLight | null {
    if (this.#active?.source === source) return null;
    return this.#update({ name, torch: null, source });
  }

  #update(next: ActiveLight): ActiveLight | null {
    const last = this.#active;
    this.#active = reuse(last, next);
    // The first light is the initial state, not a change.
    return last && this.#active !== last ? next : null;
  }
}
