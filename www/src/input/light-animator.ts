/** How light moves by itself: fire, the torch that wanders, the torch that was thrown. */

import { CENTRE } from '../shared/values.js';
import type { Lighting } from '../state/lighting.js';
import type { Frames } from './animation-loop.js';
import { glide, speed, type Velocity } from './inertia.js';
import { breathe } from './wander.js';

/** What moves on. */
export interface Moves {
  readonly fire: boolean;
  readonly breath: boolean;
}

/** Slower than so much of the picture a second, a glide has ended. */
const STILL = 0.02;

/** See the module. */
export class Movement {
  readonly #lighting: Pick<Lighting, 'burn' | 'torch' | 'holdsTorch'>;
  readonly #frames: Frames;
  readonly #changed: () => void;

  constructor(
    lighting: Pick<Lighting, 'burn' | 'torch' | 'holdsTorch'>,
    frames: Frames,
    changed: () => void,
  ) {
    this.#lighting = lighting;
    this.#frames = frames;
    this.#changed = changed;
  }

  update({ fire, breath }: Moves): void {
    if (fire) this.#frames.keep('fire', (seconds) => this.#burn(seconds));
    else this.#frames.set('fire', null);
    if (!breath) this.#frames.set('breath', null);
    else if (!this.#frames.has('breath')) this.#breathe();
  }

  /** Lets the torch glide on from where it is; so much of the picture a second. */
  throw(velocity: Velocity): void {
    let left = velocity;
    this.#frames.set('glide', (seconds) => {
      if (!this.#lighting.holdsTorch) return false;
      const next = glide(left, seconds);
      left = next.left;
      const { x, y } = this.#lighting.torch ?? CENTRE;
      this.#lighting.torch = { x: x + next.moved.x, y: y + next.moved.y };
      this.#changed();
      return speed(left) > STILL;
    });
  }

  /** Somebody holds the torch. */
  hold(): void {
    this.#frames.set('glide', null);
    this.#frames.set('breath', null);
  }

  #burn(seconds: number): boolean {
    if (this.#lighting.burn(seconds)) this.#changed();
    return true;
  }

  #breathe(): void {
    const from = this.#lighting.torch ?? CENTRE;
    let passed = 0;
    this.#frames.set('breath', (seconds) => {
      passed += seconds;
      this.#lighting.torch = breathe(from, passed);
      this.#changed();
      return true;
    });
  }
}
