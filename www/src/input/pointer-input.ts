/** Pointers and the wheel over the picture: the browser's events, told as gestures. */

import type { PicturePoint } from '../shared/values.js';
import { wheelFactor } from '../state/viewport.js';
import { type Allowed, type GestureListener, Gestures, type Pointer } from './gestures.js';

/** What is told besides gestures. */
export interface PointingListener extends GestureListener {
  /** What the picture allows now. */
  allowed(): Allowed;
  /** Magnifies at a place of the box, from 0 to 1. Gives whether there was anything to be done. */
  wheel(factor: number, at: PicturePoint): boolean;
  /** Whether the wheel is the page's unless a key is held. */
  isCooperative(): boolean;
  /** The page scrolls where somebody may have wanted to zoom. */
  scrolled(by: 'wheel' | 'touch'): void;
  /** Somebody does something. */
  touched(): void;
  /** The picture was pressed: the keyboard follows. */
  pressed(): void;
}

/** With a trackpad's pinch, which browsers tell as a wheel that turns little. */
const PINCH = 4;

/** See the module. */
export class Pointing {
  readonly #stage: HTMLElement;
  readonly #listener: PointingListener;
  readonly #gestures: Gestures;
  /** The space key is held. */
  pans = false;

  constructor(stage: HTMLElement, listener: PointingListener) {
    this.#stage = stage;
    this.#listener = listener;
    this.#gestures = new Gestures(listener);
    stage.addEventListener('pointermove', (event) => this.#move(event));
    stage.addEventListener('pointerdown', (event) => this.#down(event));
    stage.addEventListener('pointerup', (event) => this.#up(event));
    stage.addEventListener('pointercancel', (event) => {
      this.#gestures.cancel(event.pointerId);
      const { zoom } = listener.allowed();
      if (zoom && event.pointerType === 'touch') listener.scrolled('touch');
    });
    stage.addEventListener('mousedown', (event) => {
      if (isButton(event) || !this.#takes) return;
      // Neither a selection begins nor the middle button's scrolling, nor does the focus go elsewhere.
      event.preventDefault();
      listener.pressed();
    });
    // Two fingers are for the picture, also where one is for the page. Touch actions cannot say so.
    const two = (event: TouchEvent) => {
      if (event.touches.length > 1 && event.cancelable && listener.allowed().zoom)
        event.preventDefault();
    };
    stage.addEventListener('touchstart', two, { passive: false });
    stage.addEventListener('touchmove', two, { passive: false });
    stage.addEventListener('wheel', (event) => this.#wheel(event), { passive: false });
  }

  /** In pixels. */
  get size(): { readonly width: number; readonly height: number } {
    return this.#stage.getBoundingClientRect();
  }

  get #takes(): boolean {
    const { light, zoom } = this.#listener.allowed();
    return light || zoom;
  }

  #down(event: PointerEvent): void {
    const middle = event.button === 1;
    if (isButton(event) || !this.#takes || (event.button !== 0 && !middle)) return;
    this.#listener.touched();
    const pans = middle || event.shiftKey || this.pans;
    this.#gestures.down(this.#pointer(event), this.#listener.allowed(), pans);
    // A drag that leaves the picture keeps the torch at its edge. (A pointer that a script made up cannot
    // be captured.)
    if (event.isTrusted) this.#stage.setPointerCapture(event.pointerId);
  }

  #move(event: PointerEvent): void {
    if (isButton(event) || !this.#takes) return;
    this.#listener.touched();
    this.#gestures.move(this.#pointer(event), this.#listener.allowed());
  }

  #up(event: PointerEvent): void {
    this.#gestures.up(this.#pointer(event), this.#listener.allowed());
  }

  #wheel(event: WheelEvent): void {
    if (!this.#listener.allowed().zoom) return;
    const pinch = event.ctrlKey;
    if (this.#listener.isCooperative() && !pinch && !event.metaKey) {
      this.#listener.scrolled('wheel');
      return;
    }
    const { left, top, width, height } = this.#stage.getBoundingClientRect();
    const at = { x: (event.clientX - left) / width, y: (event.clientY - top) / height };
    const factor = wheelFactor(pinch ? PINCH * event.deltaY : event.deltaY, event.deltaMode);
    this.#listener.touched();
    // At either end the page scrolls on: nobody is caught over a picture.
    if (this.#listener.wheel(factor, at) || pinch) event.preventDefault();
  }

  #pointer({ pointerId, pointerType, clientX, clientY, timeStamp }: PointerEvent): Pointer {
    const { left, top } = this.#stage.getBoundingClientRect();
    const kind = pointerType === 'touch' || pointerType === 'pen' ? pointerType : 'mouse';
    return { id: pointerId, kind, x: clientX - left, y: clientY - top, time: timeStamp };
  }
}

/** The poster's button is none of the picture's business. */
function isButton({ target }: Event): boolean {
  return target instanceof Element && target.closest('button') !== null;
}
