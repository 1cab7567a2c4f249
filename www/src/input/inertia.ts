/** The glide after a throw. The velocity decays exponentially, v(t) = v₀ e^(−t/τ), so a throw travels v₀τ in total. */

/** Any unit per second. */
export interface Velocity {
  readonly x: number;
  readonly y: number;
}

/** The velocity at release counts, not the average of the drag. */
const SAMPLE_WINDOW_MS = 100;
/** A pointer that rests this long before release does not throw. */
const MAX_REST_MS = 60;
/** Samples of a shorter time are those of events that were kept until the script arrived. */
const MIN_SAMPLED_MS = 4;
/** τ: the velocity falls to 37 % in this time. */
const DECAY_SECONDS = 0.28;

export class VelocityTracker {
  #samples: { readonly x: number; readonly y: number; readonly time: number }[] = [];

  /** `time` is in milliseconds. */
  add(x: number, y: number, time: number): void {
    this.#samples = this.#samples.filter((sample) => time - sample.time <= SAMPLE_WINDOW_MS);
    this.#samples.push({ x, y, time });
  }

  velocityAt(time: number): Velocity {
    const first = this.#samples[0];
    const last = this.#samples.at(-1);
    if (
      !first ||
      !last ||
      time - last.time > MAX_REST_MS ||
      last.time - first.time < MIN_SAMPLED_MS
    ) {
      return { x: 0, y: 0 };
    }
    const seconds = (last.time - first.time) / 1000;
    return { x: (last.x - first.x) / seconds, y: (last.y - first.y) / seconds };
  }
}

/** A glide ends below this speed, in pictures or views per second. */
export const MIN_GLIDE_SPEED = 0.02;

/** The distance travelled in `seconds`, and the velocity afterwards. */
export function glide({ x, y }: Velocity, seconds: number) {
  const decay = Math.exp(-seconds / DECAY_SECONDS);
  const travel = DECAY_SECONDS * (1 - decay);
  return { moved: { x: x * travel, y: y * travel }, velocity: { x: x * decay, y: y * decay } };
}

export function speedOf({ x, y }: Velocity): number {
  return Math.hypot(x, y);
}
