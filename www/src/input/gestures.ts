/**
 * What pointers on the picture mean: taking the light along, panning, pinching, tapping twice. Knows no
 * DOM: it is told of pointers, in pixels of the picture's box, and tells what is to be done.
 */

import { speed, Track, type Velocity } from './inertia.js';

/** A pointer as it is now. */
export interface Pointer {
  readonly id: number;
  readonly kind: 'mouse' | 'touch' | 'pen';
  readonly x: number;
  readonly y: number;
  /** Milliseconds since any moment. */
  readonly time: number;
}

/** What the picture allows now. */
export interface Allowed {
  /** There is a light that moves. */
  readonly light: boolean;
  readonly zoom: boolean;
  /** It is magnified. */
  readonly zoomed: boolean;
}

/** What is to be done. */
export interface GestureListener {
  /** The light is taken to a place. */
  light(x: number, y: number): void;
  /** It was meant otherwise: the light goes back to where it was. */
  undoLight(): void;
  /** It was let go, so fast. */
  throwLight(velocity: Velocity): void;
  pan(dx: number, dy: number): void;
  /** Magnified around a place. */
  zoom(factor: number, x: number, y: number): void;
  tapTwice(x: number, y: number): void;
}

/** Two taps are one gesture within so many milliseconds, */
const TWICE_MS = 320;
/** and so many pixels; a finger that goes farther does not tap. */
const TAP_PIXELS = 12;
/** Pixels a second from which on a drag that is let go is thrown. */
const THROWN = 120;
/** A mouse that threw the light takes it up again once it has moved so far: hands are not still. */
const TAKES_UP = 8;

interface Down {
  x: number;
  y: number;
  readonly startX: number;
  readonly startY: number;
  readonly pans: boolean;
  moved: boolean;
}

/** See the module. */
export class Gestures {
  readonly #listener: GestureListener;
  readonly #down = new Map<number, Down>();
  #track = new Track();
  /** Two fingers were down since the last time that none was: what is left of them does nothing. */
  #pinched = false;
  #tapped: { readonly x: number; readonly y: number; readonly time: number } | null = null;
  #thrownAt: { readonly x: number; readonly y: number } | null = null;

  constructor(listener: GestureListener) {
    this.#listener = listener;
  }

  /** Whether a pointer holds the picture. */
  get holds(): boolean {
    return this.#down.size > 0;
  }

  /** `pan`: it was asked for, by a key or another button. */
  down({ id, x, y, time }: Pointer, allowed: Allowed, pan = false): void {
    this.#thrownAt = null;
    const pans = pan || !allowed.light;
    this.#down.set(id, { x, y, startX: x, startY: y, pans, moved: false });
    if (this.#down.size === 1) {
      this.#pinched = false;
      this.#track = new Track();
      if (pans) return;
      this.#track.add(x, y, time);
      this.#listener.light(x, y);
    } else if (allowed.zoom && !this.#pinched) {
      this.#pinched = true;
      this.#tapped = null;
      const first = this.#down.values().next().value;
      if (!first?.pans) this.#listener.undoLight();
    }
  }

  move({ id, kind, x, y, time }: Pointer, allowed: Allowed): void {
    const down = this.#down.get(id);
    if (!down) {
      if (kind !== 'touch' && this.#down.size === 0) this.#hover(x, y, allowed);
      return;
    }
    const before = this.#span();
    const [dx, dy] = [x - down.x, y - down.y];
    down.x = x;
    down.y = y;
    down.moved ||= Math.hypot(x - down.startX, y - down.startY) > TAP_PIXELS;
    if (this.#down.size > 1 && allowed.zoom) {
      const after = this.#span();
      this.#listener.pan(after.x - before.x, after.y - before.y);
      if (before.width > 0 && after.width > 0) {
        this.#listener.zoom(after.width / before.width, after.x, after.y);
      }
    } else if (this.#pinched) {
      // One of two fingers was lifted first.
    } else if (down.pans) {
      if (allowed.zoomed) this.#listener.pan(dx, dy);
    } else if (allowed.light && id === this.#down.keys().next().value) {
      this.#track.add(x, y, time);
      this.#listener.light(x, y);
    }
  }

  up({ id, x, y, time }: Pointer, allowed: Allowed): void {
    const down = this.#down.get(id);
    if (!down) return;
    this.#down.delete(id);
    if (this.#down.size > 0 || this.#pinched) return;
    if (!down.moved) {
      this.#tap(x, y, time, allowed);
      return;
    }
    this.#tapped = null;
    const velocity = this.#track.velocity(time);
    if (down.pans || !allowed.light || speed(velocity) < THROWN) return;
    this.#thrownAt = { x, y };
    this.#listener.throwLight(velocity);
  }

  /** The browser has taken it for something of its own. */
  cancel(id: number): void {
    this.#down.delete(id);
    this.#tapped = null;
  }

  #hover(x: number, y: number, { light }: Allowed): void {
    if (!light) return;
    const from = this.#thrownAt;
    if (from && Math.hypot(x - from.x, y - from.y) < TAKES_UP) return;
    this.#thrownAt = null;
    this.#listener.light(x, y);
  }

  #tap(x: number, y: number, time: number, allowed: Allowed): void {
    const before = this.#tapped;
    const twice =
      before &&
      time - before.time <= TWICE_MS &&
      Math.hypot(x - before.x, y - before.y) <= 2 * TAP_PIXELS;
    this.#tapped = twice ? null : { x, y, time };
    if (twice && allowed.zoom) this.#listener.tapTwice(x, y);
  }

  /** Of the first two pointers: what lies between them, and how far that is. */
  #span(): { x: number; y: number; width: number } {
    const [a, b] = [...this.#down.values()];
    if (!a || !b) return { x: a?.x ?? 0, y: a?.y ?? 0, width: 0 };
    return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, width: Math.hypot(a.x - b.x, a.y - b.y) };
  }
}
