/** Animates the light: the fire, the wandering torch, the thrown torch. */

import { CENTRE } from '../shared/value-types.js';
import type { LightState } from '../state/light-state.js';
import type { AnimationCallback, AnimationLoop } from './animation-loop.js';
import { glide, MIN_GLIDE_SPEED, speedOf, type Velocity } from './inertia.js';
import { wander } from './wander.js';

export class LightAnimator {
  constructor(
    private readonly light: Pick<LightState, 'advanceFire' | 'torch' | 'isTorch'>,
    private readonly loop: AnimationLoop,
    private readonly changed: () => void,
  ) {}

  /** Starts and stops the continuous animations. */
  update({ fire, wander }: { readonly fire: boolean; readonly wander: boolean }): void {
    this.loop.toggle('fire', fire, () => (seconds) => {
      if (this.light.advanceFire(seconds)) this.changed();
      return true;
    });
    this.loop.toggle('wander', wander, () => this.#wander());
  }

  /** Lets the torch glide on; the velocity is in pictures per second. */
  throwTorch(initial: Velocity): void {
    let velocity = initial;
    this.loop.set('glide', (seconds) => {
      if (!this.light.isTorch) return false;
      const next = glide(velocity, seconds);
      velocity = next.velocity;
      const { x, y } = this.light.torch ?? CENTRE;
      this.light.torch = { x: x + next.moved.x, y: y + next.moved.y };
      this.changed();
      return speedOf(velocity) > MIN_GLIDE_SPEED;
    });
  }

  stopTorch(): void {
    this.loop.set('glide', null);
    this.loop.set('wander', null);
  }

  #wander(): AnimationCallback {
    const start = this.light.torch ?? CENTRE;
    let elapsed = 0;
    return (seconds) => {
      elapsed += seconds;
      this.light.torch = wander(start, elapsed);
      this.changed();
      return true;
    };
  }
}
