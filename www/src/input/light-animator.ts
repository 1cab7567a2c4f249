/** Animates the light: the fire, the wandering torch, the thrown torch. */

import { CENTRE } from '../shared/values.js';
import type { LightState } from '../state/light-state.js';
import type { AnimationLoop } from './animation-loop.js';
import { glide, speedOf, type Velocity } from './inertia.js';
import { wander } from './wander.js';

/** A glide ends below this speed, in pictures per second. */
const MIN_GLIDE_SPEED = 0.02;

type AnimatedLight = Pick<LightState, 'advanceFire' | 'torch' | 'isTorch'>;

export class LightAnimator {
  readonly #light: AnimatedLight;
  readonly #loop: AnimationLoop;
  readonly #changed: () => void;

  constructor(light: AnimatedLight, loop: AnimationLoop, changed: () => void) {
    this.#light = light;
    this.#loop = loop;
    this.#changed = changed;
  }

  /** Starts and stops the continuous animations. */
  update({ fire, wander }: { readonly fire: boolean; readonly wander: boolean }): void {
    if (!fire) this.#loop.set('fire', null);
    else if (!this.#loop.has('fire')) this.#startFire();
    if (!wander) this.#loop.set('wander', null);
    else if (!this.#loop.has('wander')) this.#startWandering();
  }

  /** Lets the torch glide on; the velocity is in pictures per second. */
  throwTorch(initial: Velocity): void {
    let velocity = initial;
    this.#loop.set('glide', (seconds) => {
      if (!this.#light.isTorch) return false;
      const next = glide(velocity, seconds);
      velocity = next.velocity;
      const { x, y } = this.#light.torch ?? CENTRE;
      this.#light.torch = { x: x + next.moved.x, y: y + next.moved.y };
      this.#changed();
      return speedOf(velocity) > MIN_GLIDE_SPEED;
    });
  }

  /** Stops the torch where it is. */
  stopTorch(): void {
    this.#loop.set('glide', null);
    this.#loop.set('wander', null);
  }

  #startFire(): void {
    this.#loop.set('fire', (seconds) => {
      if (this.#light.advanceFire(seconds)) this.#changed();
      return true;
    });
  }

  #startWandering(): void {
    const start = this.#light.torch ?? CENTRE;
    let elapsed = 0;
    this.#loop.set('wander', (seconds) => {
      elapsed += seconds;
      this.#light.torch = wander(start, elapsed);
      this.#changed();
      return true;
    });
  }
}
