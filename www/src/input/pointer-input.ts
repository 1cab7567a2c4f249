/** Feeds the browser's pointer and wheel events over the picture to the gesture recognizer. */

import type { PicturePoint } from '../shared/value-types.js';
import { wheelFactor } from '../state/viewport.js';
import { type EnabledGestures, type GestureListener, GestureRecognizer } from './gestures.js';

export interface PointerInputListener extends GestureListener {
  permissions(): EnabledGestures;
  /** Whether drags pan, because a key is held. */
  isPanning(): boolean;
  /** Whether the page keeps the wheel unless a modifier key is held. */
  isCooperative(): boolean;
  /** The page scrolled where the visitor may have wanted to zoom. */
  zoomIgnored(by: 'wheel' | 'touch'): void;
  /** The wheel zooms. */
  active(): void;
  /** The picture was pressed and should take the keyboard's focus. */
  pressed(): void;
}

/** Browsers report a trackpad's pinch as a wheel with small steps and `ctrlKey`. */
const PINCH_WHEEL_GAIN = 4;

/** Listens for as long as the viewport exists. */
export function listenToPointer(viewport: HTMLElement, listener: PointerInputListener): void {
  const gestures = new GestureRecognizer(listener);
  const hasGestures = () => {
    const { movesLight, zooms } = listener.permissions();
    return movesLight || zooms;
  };
  /** Whether a press is for the picture. The page handles presses on its overlay. */
  const isForPicture = ({ target }: Event) =>
    hasGestures() && !(target as Element).closest('[slot="overlay"]');
  const positionOf = ({ clientX, clientY }: MouseEvent) => {
    const { left, top } = viewport.getBoundingClientRect();
    return { x: clientX - left, y: clientY - top };
  };
  const sampleOf = (event: PointerEvent) => {
    const { pointerId: id, pointerType, timeStamp: time } = event;
    return { id, isTouch: pointerType === 'touch', time, ...positionOf(event) };
  };
  viewport.addEventListener('pointermove', (event) => {
    if (!hasGestures()) return;
    gestures.move(sampleOf(event), listener.permissions());
  });
  viewport.addEventListener('pointerdown', (event) => {
    const isMiddle = event.button === 1;
    if (!isForPicture(event) || (event.button !== 0 && !isMiddle)) return;
    const forcePan = isMiddle || event.shiftKey || listener.isPanning();
    gestures.down(sampleOf(event), listener.permissions(), forcePan);
    // A drag that leaves the picture continues. Pointers of synthetic events cannot be captured.
    if (event.isTrusted) viewport.setPointerCapture(event.pointerId);
  });
  viewport.addEventListener('pointerup', (event) =>
    gestures.up(sampleOf(event), listener.permissions()),
  );
  viewport.addEventListener('pointercancel', (event) => {
    gestures.cancel(event.pointerId);
    if (listener.permissions().zooms && event.pointerType === 'touch') {
      listener.zoomIgnored('touch');
    }
  });
  viewport.addEventListener('mousedown', (event) => {
    if (!isForPicture(event)) return;
    // Prevents a text selection, the middle button's scrolling and a change of the focus.
    event.preventDefault();
    listener.pressed();
  });
  // Two fingers zoom the picture even where one finger scrolls the page; touch-action cannot express this.
  const preventPageZoom = (event: TouchEvent) => {
    const isPinch = event.touches.length > 1 && event.cancelable;
    if (isPinch && listener.permissions().zooms) event.preventDefault();
  };
  viewport.addEventListener('touchstart', preventPageZoom, { passive: false });
  viewport.addEventListener('touchmove', preventPageZoom, { passive: false });
  const zoomByWheel = (event: WheelEvent) => {
    if (!listener.permissions().zooms) return;
    const isPinch = event.ctrlKey;
    if (listener.isCooperative() && !isPinch && !event.metaKey) {
      listener.zoomIgnored('wheel');
      return;
    }
    const { x, y } = positionOf(event);
    const delta = isPinch ? PINCH_WHEEL_GAIN * event.deltaY : event.deltaY;
    listener.active();
    // At the smallest and largest zoom the page scrolls on, so that the picture does not trap the wheel.
    const hasZoomed = listener.zoom(wheelFactor(delta, event.deltaMode), x, y);
    if (hasZoomed || isPinch) event.preventDefault();
  };
  viewport.addEventListener('wheel', zoomByWheel, { passive: false });
}

/** From pixels to units of the viewport, 0 to 1. */
export function toViewportUnits(viewport: Element, x: number, y: number): PicturePoint {
  const { width, height } = viewport.getBoundingClientRect();
  return { x: x / Math.max(1, width), y: y / Math.max(1, height) };
}
