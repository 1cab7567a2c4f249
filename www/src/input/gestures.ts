/** Recognises gestures on the picture: moving and throwing the light, panning, pinching, double taps. Uses no DOM. */

import { speedOf, type Velocity, VelocityTracker } from './inertia.js';

export interface PointerSample {
  readonly id: number;
  readonly isTouch: boolean;
  readonly x: number;
  readonly y: number;
  /** Milliseconds since any origin. */
  readonly time: number;
}

export interface EnabledGestures {
  readonly movesLight: boolean;
  readonly zooms: boolean;
  /** The picture is magnified, so that panning has an effect. */
  readonly isZoomed: boolean;
}

/** All coordinates and distances are in viewport pixels, velocities in pixels per second. */
export interface GestureListener {
  moveLight(x: number, y: number): void;
  /** The gesture has become a pinch: the light returns to where it was before. */
  restoreLight(): void;
  /** The light was released in motion. */
  throwLight(velocity: Velocity): void;
  pan(dx: number, dy: number): void;
  /** The picture was released in motion while it was panned. */
  throwView(velocity: Velocity): void;
  /** The picture was pressed: it does not glide on. */
  holdView(): void;
  /** Magnify by `factor` around a point. Returns whether the view has changed. */
  zoom(factor: number, x: number, y: number): boolean;
  doubleTap(x: number, y: number): void;
}

const DOUBLE_TAP_MS = 320;
/** A pointer that moves farther than this does not tap. */
const MAX_TAP_PIXELS = 12;
/** Releasing a faster drag throws the light or the picture. Pixels per second. */
const MIN_THROW_SPEED = 120;
/** Hands tremble: after a throw, the mouse takes the light again only after this distance. */
const MIN_HOVER_PIXELS = 8;

interface PressedPointer {
  x: number;
  y: number;
  readonly startX: number;
  readonly startY: number;
  readonly pans: boolean;
  hasMoved: boolean;
}

export class GestureRecognizer {
  readonly #pressed = new Map<number, PressedPointer>();
  #velocity = new VelocityTracker();
  /** Two fingers were down at once; ignore the remaining finger until all are up. */
  #hasPinched = false;
  #lastTap: { readonly x: number; readonly y: number; readonly time: number } | null = null;
  #throwPoint: { readonly x: number; readonly y: number } | null = null;

  constructor(private readonly listener: GestureListener) {}

  get isPressed(): boolean {
    return this.#pressed.size > 0;
  }

  /** `forcePan`: a modifier key or another button requests panning. */
  down({ id, x, y, time }: PointerSample, allowed: EnabledGestures, forcePan = false): void {
    this.#throwPoint = null;
    this.listener.holdView();
    const pans = forcePan || !allowed.movesLight;
    this.#pressed.set(id, { x, y, startX: x, startY: y, pans, hasMoved: false });
    if (this.#pressed.size === 1) {
      this.#hasPinched = false;
      this.#velocity = new VelocityTracker();
      this.#velocity.add(x, y, time);
      if (pans) return;
      this.listener.moveLight(x, y);
    } else if (allowed.zooms && !this.#hasPinched) {
      this.#hasPinched = true;
      this.#lastTap = null;
      const first = this.#pressed.values().next().value;
      if (!first?.pans) this.listener.restoreLight();
    }
  }

  move({ id, isTouch, x, y, time }: PointerSample, allowed: EnabledGestures): void {
    const pointer = this.#pressed.get(id);
    if (!pointer) {
      if (!isTouch && !this.isPressed) this.#hover(x, y, allowed);
      return;
    }
    const before = this.#pinchGeometry();
    const [dx, dy] = [x - pointer.x, y - pointer.y];
    pointer.x = x;
    pointer.y = y;
    pointer.hasMoved ||= Math.hypot(x - pointer.startX, y - pointer.startY) > MAX_TAP_PIXELS;
    if (this.#pressed.size > 1 && allowed.zooms) {
      const after = this.#pinchGeometry();
      this.listener.pan(after.x - before.x, after.y - before.y);
      if (before.distance > 0 && after.distance > 0) {
        this.listener.zoom(after.distance / before.distance, after.x, after.y);
      }
    } else if (this.#hasPinched) {
      // Ignore the remaining finger of a pinch.
    } else if (pointer.pans) {
      this.#velocity.add(x, y, time);
      if (allowed.isZoomed) this.listener.pan(dx, dy);
    } else if (allowed.movesLight && id === this.#pressed.keys().next().value) {
      this.#velocity.add(x, y, time);
      this.listener.moveLight(x, y);
    }
  }

  up({ id, x, y, time }: PointerSample, allowed: EnabledGestures): void {
    const pointer = this.#pressed.get(id);
    if (!pointer) return;
    this.#pressed.delete(id);
    if (this.isPressed || this.#hasPinched) return;
    if (!pointer.hasMoved) {
      this.#tap(x, y, time, allowed);
      return;
    }
    this.#lastTap = null;
    const velocity = this.#velocity.velocityAt(time);
    if (speedOf(velocity) < MIN_THROW_SPEED) return;
    if (pointer.pans) {
      if (allowed.isZoomed) this.listener.throwView(velocity);
    } else if (allowed.movesLight) {
      this.#throwPoint = { x, y };
      this.listener.throwLight(velocity);
    }
  }

  /** The browser uses the pointer for itself, for example for scrolling. */
  cancel(id: number): void {
    this.#pressed.delete(id);
    this.#lastTap = null;
  }

  #hover(x: number, y: number, { movesLight }: EnabledGestures): void {
    if (!movesLight) return;
    const from = this.#throwPoint;
    if (from && Math.hypot(x - from.x, y - from.y) < MIN_HOVER_PIXELS) return;
    this.#throwPoint = null;
    this.listener.moveLight(x, y);
  }

  #tap(x: number, y: number, time: number, { zooms }: EnabledGestures): void {
    const last = this.#lastTap;
    const isNear = last && Math.hypot(x - last.x, y - last.y) <= 2 * MAX_TAP_PIXELS;
    const isDouble = isNear && time - last.time <= DOUBLE_TAP_MS;
    this.#lastTap = isDouble ? null : { x, y, time };
    if (isDouble && zooms) this.listener.doubleTap(x, y);
  }

  /** The midpoint and distance of the first two pointers. */
  #pinchGeometry(): { x: number; y: number; distance: number } {
    const [a, b] = [...this.#pressed.values()];
    if (!a || !b) return { x: a?.x ?? 0, y: a?.y ?? 0, distance: 0 };
    return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, distance: Math.hypot(a.x - b.x, a.y - b.y) };
  }
}
