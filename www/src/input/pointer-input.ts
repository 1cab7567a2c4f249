/** Feeds the browser's pointer and wheel events over the picture to the gesture recognizer. */

import type { PicturePoint } from '../shared/values.js';
import { wheelFactor } from '../state/viewport.js';
import {
  type GestureListener,
  type GesturePermissions,
  GestureRecognizer,
  type PointerSample,
} from './gestures.js';

export interface PointerInputListener extends GestureListener {
  permissions(): GesturePermissions;
  /** Whether the page keeps the wheel unless a modifier key is held. */
  isCooperative(): boolean;
  /** The page scrolled where the visitor may have wanted to zoom. */
  zoomIgnored(by: 'wheel' | 'touch'): void;
  active(): void;
  /** The picture was pressed and should take the keyboard's focus. */
  pressed(): void;
}

/** Browsers report a trackpad's pinch as a wheel with small steps and `ctrlKey`. */
const PINCH_WHEEL_GAIN = 4;

export class PointerInput {
  readonly #viewport: HTMLElement;
  readonly #listener: PointerInputListener;
  readonly #gestures: GestureRecognizer;
  /** The space key is held: drags pan. */
  isPanning = false;

  constructor(viewport: HTMLElement, listener: PointerInputListener) {
    this.#viewport = viewport;
    this.#listener = listener;
    this.#gestures = new GestureRecognizer(listener);
    viewport.addEventListener('pointermove', (event) => this.#move(event));
    viewport.addEventListener('pointerdown', (event) => this.#down(event));
    viewport.addEventListener('pointerup', (event) => this.#up(event));
    viewport.addEventListener('pointercancel', (event) => {
      this.#gestures.cancel(event.pointerId);
      const { zooms } = listener.permissions();
      if (zooms && event.pointerType === 'touch') listener.zoomIgnored('touch');
    });
    viewport.addEventListener('mousedown', (event) => {
      if (isOnButton(event) || !this.#isInteractive) return;
      // Prevents a text selection, the middle button's scrolling and a change of the focus.
      event.preventDefault();
      listener.pressed();
    });
    // Two fingers zoom the picture even where one finger scrolls the page; touch-action cannot express this.
    const preventPageZoom = (event: TouchEvent) => {
      if (event.touches.length > 1 && event.cancelable && listener.permissions().zooms)
        event.preventDefault();
    };
    viewport.addEventListener('touchstart', preventPageZoom, { passive: false });
    viewport.addEventListener('touchmove', preventPageZoom, { passive: false });
    viewport.addEventListener('wheel', (event) => this.#wheel(event), { passive: false });
  }

  /** From viewport pixels to viewport units, 0 to 1. */
  toUnits(x: number, y: number): PicturePoint {
    const { width, height } = this.#viewport.getBoundingClientRect();
    return { x: x / Math.max(1, width), y: y / Math.max(1, height) };
  }

  get #isInteractive(): boolean {
    const { movesLight, zooms } = this.#listener.permissions();
    return movesLight || zooms;
  }

  #down(event: PointerEvent): void {
    const isMiddle = event.button === 1;
    if (isOnButton(event) || !this.#isInteractive || (event.button !== 0 && !isMiddle)) return;
    this.#listener.active();
    const forcePan = isMiddle || event.shiftKey || this.isPanning;
    this.#gestures.down(this.#sample(event), this.#listener.permissions(), forcePan);
    // A drag that leaves the picture continues. Pointers of synthetic events cannot be captured.
    if (event.isTrusted) this.#viewport.setPointerCapture(event.pointerId);
  }

  #move(event: PointerEvent): void {
    if (isOnButton(event) || !this.#isInteractive) return;
    this.#listener.active();
    this.#gestures.move(this.#sample(event), this.#listener.permissions());
  }

  #up(event: PointerEvent): void {
    this.#gestures.up(this.#sample(event), this.#listener.permissions());
  }

  #wheel(event: WheelEvent): void {
    if (!this.#listener.permissions().zooms) return;
    const isPinch = event.ctrlKey;
    if (this.#listener.isCooperative() && !isPinch && !event.metaKey) {
      this.#listener.zoomIgnored('wheel');
      return;
    }
    const { left, top } = this.#viewport.getBoundingClientRect();
    const delta = isPinch ? PINCH_WHEEL_GAIN * event.deltaY : event.deltaY;
    this.#listener.active();
    // At the smallest and largest zoom the page scrolls on, so that the picture does not trap the wheel.
    const factor = wheelFactor(delta, event.deltaMode);
    const hasZoomed = this.#listener.zoom(factor, event.clientX - left, event.clientY - top);
    if (hasZoomed || isPinch) event.preventDefault();
  }

  #sample({ pointerId, pointerType, clientX, clientY, timeStamp }: PointerEvent): PointerSample {
    const { left, top } = this.#viewport.getBoundingClientRect();
    const kind = pointerType === 'touch' || pointerType === 'pen' ? pointerType : 'mouse';
    return { id: pointerId, kind, x: clientX - left, y: clientY - top, time: timeStamp };
  }
}

/** The poster's button lies over the picture and handles its own events. */
function isOnButton({ target }: Event): boolean {
  return target instanceof Element && target.closest('button') !== null;
}
