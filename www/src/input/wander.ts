/** What happens while nobody does anything: the light breathes, and a kiosk goes back to its beginning. */

import type { PicturePoint } from '../shared/values.js';

/** Calls back once after so many milliseconds, unless what it gives is called first. */
export type Later = (ms: number, callback: () => void) => () => void;

/** What is told. */
export interface IdleListener {
  /** Nobody has done anything for some seconds. */
  rested(): void;
  /** Nor for as long as a kiosk waits, since somebody did. */
  expired(): void;
}

/** After so long the light wanders again by itself. */
export const REST_MS = 8000;
/** A way round takes about so many seconds: slow enough for eyes to rest on it. */
const ROUND = 16;
/** How far it wanders from the middle, of the picture. */
const REACH = { x: 0.3, y: 0.26 };
/** In so many seconds it has come from where it was left. */
const ARRIVES = 3;

/** See the module. */
export class Idle {
  readonly #later: Later;
  readonly #listener: IdleListener;
  #kioskMs = 0;
  #touched = false;
  #endRest = (): void => {};
  #endKiosk = (): void => {};

  constructor(later: Later, listener: IdleListener) {
    this.#later = later;
    this.#listener = listener;
  }

  /** After how many seconds everything is as it was; never with 0. */
  set kiosk(seconds: number) {
    if (1000 * seconds === this.#kioskMs) return;
    this.#kioskMs = 1000 * seconds;
    if (this.#touched) this.#awaitKiosk();
  }

  /** Somebody does something. */
  touch(): void {
    this.#touched = true;
    this.#endRest();
    this.#endRest = this.#later(REST_MS, () => this.#listener.rested());
    this.#awaitKiosk();
  }

  stop(): void {
    this.#touched = false;
    this.#endRest();
    this.#endKiosk();
  }

  #awaitKiosk(): void {
    this.#endKiosk();
    if (this.#kioskMs === 0) return;
    this.#endKiosk = this.#later(this.#kioskMs, () => {
      this.#touched = false;
      this.#listener.expired();
    });
  }
}

/** Where a breathing light is, so many seconds after it was left at a point. */
export function breathe(from: PicturePoint, seconds: number): PicturePoint {
  const turn = (2 * Math.PI * seconds) / ROUND;
  const x = 0.5 + REACH.x * Math.sin(turn);
  const y = 0.5 + REACH.y * Math.sin(0.618 * turn + 0.9);
  const share = Math.min(1, seconds / ARRIVES);
  const eased = share * share * (3 - 2 * share);
  return { x: from.x + eased * (x - from.x), y: from.y + eased * (y - from.y) };
}
