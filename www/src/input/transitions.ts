/** Eased changes that take some time, and end early when a visitor or a script interferes. */

import { CENTRE } from '../shared/value-types.js';
import { DEFAULT_TORCH_SIZE } from '../state/attribute-parsers.js';
import type { ViewerState } from '../state/viewer-state.js';
import type { ZoomView } from '../state/viewport.js';
import type { AnimationLoop } from './animation-loop.js';

/** Options of `lightTo` and `viewTo`. */
export interface TransitionOptions {
  /** In milliseconds, as in `Element.animate`; 600 by default. */
  readonly duration?: number;
}

const DEFAULT_DURATION_MS = 600;

type TransitionName = 'light' | 'view';

export class Transitions {
  readonly #running = new Map<TransitionName, { show(progress: number): void; done(): void }>();

  constructor(private readonly loop: Pick<AnimationLoop, 'set'>) {}

  isRunning(name: TransitionName): boolean {
    return this.#running.has(name);
  }

  /** Calls `show` with 0 at once, and with up to 1 in each frame. Resolves at the end, also at an early one. */
  run(name: TransitionName, ms: number, show: (progress: number) => void): Promise<void> {
    this.end(name);
    if (ms <= 0) {
      show(1);
      return Promise.resolve();
    }
    show(0);
    let elapsedMs = 0;
    this.loop.set(`${name} transition`, (seconds) => {
      elapsedMs += 1000 * seconds;
      const time = Math.min(1, elapsedMs / ms);
      show(time * time * (3 - 2 * time));
      if (time === 1) this.end(name);
      return time < 1;
    });
    return new Promise((done) => {
      this.#running.set(name, { show, done });
    });
  }

  /** Nobody sees them any more: all are at their ends. */
  finish(): void {
    for (const [name, { show }] of [...this.#running]) {
      show(1);
      this.end(name);
    }
  }

  /** What is shown stays. */
  end(name: TransitionName): void {
    this.loop.set(`${name} transition`, null);
    this.#running.get(name)?.done();
    this.#running.delete(name);
  }
}

/** Sets another light by `set`, and returns a function that shows the torch on its way there. */
export function torchTransition({ light }: ViewerState, set: () => void): (at: number) => void {
  const current = () => ({ ...(light.torch ?? CENTRE), size: light.size ?? DEFAULT_TORCH_SIZE });
  const from = current();
  set();
  const to = current();
  const { overrides } = light;
  return (at) => {
    if (at === 1) {
      light.override(overrides);
      return;
    }
    const torch = { x: mix(from.x, to.x, at), y: mix(from.y, to.y, at) };
    light.override({ torch, ...(from.size !== to.size && { size: mix(from.size, to.size, at) }) });
  };
}

/** The view between two others. Zooming keeps one point of the picture fixed. */
export function viewBetween(from: ZoomView, to: ZoomView, at: number): ZoomView {
  if (at === 1) return to;
  const zoom = from.zoom * (to.zoom / from.zoom) ** at;
  // The centre moves in proportion to the size of the visible part.
  const share =
    from.zoom === to.zoom ? at : (1 / from.zoom - 1 / zoom) / (1 / from.zoom - 1 / to.zoom);
  return { zoom, x: mix(from.x, to.x, share), y: mix(from.y, to.y, share) };
}

function mix(from: number, to: number, share: number): number {
  return from + share * (to - from);
}

/** The duration in milliseconds. @throws {TypeError} if it is invalid */
export function durationOf({ duration = DEFAULT_DURATION_MS }: TransitionOptions): number {
  if (duration >= 0) return duration;
  throw new TypeError(`duration must be a number of milliseconds, but is ${duration}`);
}
