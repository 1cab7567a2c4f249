/** What goes on gliding when a drag is let go. Distances are in any unit, times in milliseconds. */

export interface Velocity {
  /** Units a second. */
  readonly x: number;
  readonly y: number;
}

/** What counts is how fast it was at the end, not on the whole. */
const REMEMBERED_MS = 100;
/** Who has held still for so long has not thrown. */
const HELD_MS = 60;
/** In so many seconds a glide falls to a third of its speed. */
const TIME_CONSTANT = 0.28;

/** The way of a pointer, of late. */
export class Track {
  #samples: { readonly x: number; readonly y: number; readonly time: number }[] = [];

  add(x: number, y: number, time: number): void {
    this.#samples = this.#samples.filter((sample) => time - sample.time <= REMEMBERED_MS);
    this.#samples.push({ x, y, time });
  }

  /** How fast it moves at that time. */
  velocity(time: number): Velocity {
    const first = this.#samples[0];
    const last = this.#samples.at(-1);
    if (!first || !last || time - last.time > HELD_MS || last.time - first.time <= 0) {
      return { x: 0, y: 0 };
    }
    const seconds = (last.time - first.time) / 1000;
    return { x: (last.x - first.x) / seconds, y: (last.y - first.y) / seconds };
  }
}

/** Where a glide is after some seconds more, and how fast it still is. */
export function glide(velocity: Velocity, seconds: number): { moved: Velocity; left: Velocity } {
  const kept = Math.exp(-seconds / TIME_CONSTANT);
  const way = TIME_CONSTANT * (1 - kept);
  return {
    moved: { x: velocity.x * way, y: velocity.y * way },
    left: { x: velocity.x * kept, y: velocity.y * kept },
  };
}

/** Units a second. */
export function speed({ x, y }: Velocity): number {
  return Math.hypot(x, y);
}
