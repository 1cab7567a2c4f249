/**
 * The overview of a magnified picture, with a frame around the visible part. It is a separate script, because few
 * elements have one. Keyboards and screen readers have the keys that pan instead.
 */

import { toPicture, type ZoomView } from '../state/viewport.js';
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
  /** It appears with its first picture. */
  isShown = false;
  #view: ZoomView | null = null;
  #pointer: number | null = null;

  /** `moveTo` gets the point of the picture that a visitor points at. */
  constructor(
    private readonly dom: ShadowDom,
    private readonly moveTo: (x: number, y: number) => void,
  ) {
    adoptStyles(dom.root, MINIMAP_CSS);
    const element = this.#element;
    dom.contentBox.append(element);
    element.addEventListener('pointerdown', (event) => {
      if (event.button !== 0 || !event.isPrimary) return;
      this.#pointer = event.pointerId;
      if (event.isTrusted) element.setPointerCapture(event.pointerId);
      this.#point(event);
    });
    element.addEventListener('pointermove', (event) => {
      if (event.buttons & 1) this.#point(event);
    });
    const release = ({ pointerId }: PointerEvent) => {
      if (pointerId === this.#pointer) this.#pointer = null;
    };
    element.addEventListener('pointerup', release);
    element.addEventListener('pointercancel', release);
    element.addEventListener('lostpointercapture', release);
    // The keyboard's focus stays, and no text is selected.
    element.addEventListener('mousedown', (event) => event.preventDefault());
  }

  /** Frames the visible part of a view; `null` hides the overview. Returns whether it has appeared or disappeared. */
  show(view: ZoomView | null): boolean {
    const wasShown = this.isShown;
    this.#view = view;
    this.isShown = view !== null;
    if (!view) {
      this.#element.hidden = true;
      return wasShown;
    }
    const visible = this.#visiblePart(view);
    const percent = (share: number) => `${100 * share}%`;
    Object.assign(this.#frame.style, {
      left: percent(visible.x),
      top: percent(visible.y),
      width: percent(visible.width),
      height: percent(visible.height),
    });
    return !wasShown;
  }

  /** Copies a picture, in the task in which it was drawn. */
  draw(picture: HTMLCanvasElement): void {
    if (!this.isShown) return;
    const canvas = this.#canvas;
    const factor = Math.min(1, MAX_PIXELS / Math.max(picture.width, picture.height));
    const width = Math.max(1, Math.round(factor * picture.width));
    const height = Math.max(1, Math.round(factor * picture.height));
    if (canvas.width !== width) canvas.width = width;
    if (canvas.height !== height) canvas.height = height;
    canvas.getContext('2d')?.drawImage(picture, 0, 0, width, height);
    this.#element.hidden = false;
  }

  #point({ pointerId, clientX, clientY }: PointerEvent): void {
    const view = this.#view;
    if (pointerId !== this.#pointer || !view) return;
    const { left, top, width, height } = this.#canvas.getBoundingClientRect();
    // The centre of the visible part goes there: where object-fit crops, it is not that of the view.
    const visible = this.#visiblePart(view);
    const x = view.x - (visible.x + visible.width / 2) + (clientX - left) / width;
    const y = view.y - (visible.y + visible.height / 2) + (clientY - top) / height;
    this.moveTo(x, y);
  }

  /** In fractions of the picture. The element may cut a part of the view off, by `object-fit`. */
  #visiblePart(view: ZoomView) {
    const box = this.dom.viewport.getBoundingClientRect();
    const element = this.dom.contentBox.getBoundingClientRect();
    const corner = (x: number, y: number) =>
      toPicture(view, { x: (x - box.left) / box.width, y: (y - box.top) / box.height });
    const { x, y } = corner(Math.max(box.left, element.left), Math.max(box.top, element.top));
    const end = corner(Math.min(box.right, element.right), Math.min(box.bottom, element.bottom));
    return { x, y, width: end.x - x, height: end.y - y };
  }
}
