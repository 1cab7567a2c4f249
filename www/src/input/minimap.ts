/**
 * The overview of a magnified picture, with a frame around the part that the view shows. It is a separate script, because
 * few elements have one. Keyboards and screen readers have the keys that pan instead.
 */

import type { ZoomView } from '../state/viewport.js';
import { adoptStyles } from '../ui/adopted-styles.js';
import { createElement } from '../ui/dom-helpers.js';
import type { ShadowDom } from '../ui/shadow-dom.js';
import MINIMAP_CSS from './minimap.css';

/** The longer side of its picture. */
const MAX_PIXELS = 320;

export class Minimap {
  readonly #canvas = document.createElement('canvas');
  readonly #frame = createElement('div', { class: 'minimap-frame' });
  readonly #element = createElement(
    'div',
    { class: 'minimap', part: 'minimap', 'aria-hidden': 'true', hidden: '' },
    this.#canvas,
    this.#frame,
  );

  /** `moveTo` gets the point of the picture that a visitor points at. */
  constructor(dom: ShadowDom, moveTo: (x: number, y: number) => void) {
    adoptStyles(dom.root, MINIMAP_CSS);
    const element = this.#element;
    dom.contentBox.append(element);
    const move = ({ clientX, clientY }: PointerEvent) => {
      const { left, top, width, height } = element.getBoundingClientRect();
      moveTo((clientX - left) / width, (clientY - top) / height);
    };
    element.addEventListener('pointerdown', (event) => {
      if (event.button !== 0) return;
      if (event.isTrusted) element.setPointerCapture(event.pointerId);
      move(event);
    });
    element.addEventListener('pointermove', (event) => {
      if (event.buttons & 1) move(event);
    });
  }

  /** Frames what a view shows; `null` hides the overview. Returns whether it has appeared, without a picture yet. */
  show(view: ZoomView | null): boolean {
    const wasHidden = this.#element.hidden !== false;
    this.#element.hidden = view === null;
    if (!view) return false;
    const { zoom, x, y } = view;
    const percent = (share: number) => `${100 * share}%`;
    Object.assign(this.#frame.style, {
      left: percent(x - 0.5 / zoom),
      top: percent(y - 0.5 / zoom),
      width: percent(1 / zoom),
      height: percent(1 / zoom),
    });
    return wasHidden;
  }

  /** Copies a picture, in the task in which it was drawn. */
  draw(picture: HTMLCanvasElement): void {
    if (this.#element.hidden) return;
    const canvas = this.#canvas;
    const factor = Math.min(1, MAX_PIXELS / Math.max(picture.width, picture.height));
    const width = Math.max(1, Math.round(factor * picture.width));
    const height = Math.max(1, Math.round(factor * picture.height));
    if (canvas.width !== width) canvas.width = width;
    if (canvas.height !== height) canvas.height = height;
    canvas.getContext('2d')?.drawImage(picture, 0, 0, width, height);
  }
}
