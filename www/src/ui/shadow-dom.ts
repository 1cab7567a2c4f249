/**
 * The element's shadow DOM: a spacer, which gives the element its natural size; over it the viewport with picture,
 * overlay and torch handle, the poster, the controls, the progress bar and the message.
 */

import { type Language, t } from '../i18n/translations.js';
import type { PicturePoint } from '../shared/value-types.js';
import type { ElementOptions } from '../state/options.js';
import { toViewport, type ZoomView } from '../state/viewport.js';
import { adoptStyles } from './adopted-styles.js';
import { createElement, createSlot, updateAttribute, updateText } from './dom-helpers.js';
import { createIcon, LIGHT_ICON } from './icons.js';
import { placePicture } from './object-fit.js';
import ELEMENT_CSS from './style.css';

/** Beyond this zoom, pixels are drawn as squares. */
const MIN_PIXELATED_ZOOM = 4;
/** An announcement waits this long, so that a newer one can replace it. */
const ANNOUNCE_DELAY_MS = 400;
/** The natural size until a better one is known, in pixels. */
const UNKNOWN_SIZE: Size = { width: 300, height: 300 };

interface Size {
  readonly width: number;
  readonly height: number;
}

export class ShadowDom {
  readonly root: ShadowRoot;
  /** Represents the torch for keyboards and screen readers. */
  readonly handle = createElement('div', {
    class: 'handle',
    part: 'torch-handle',
    role: 'slider',
    tabindex: '0',
    'aria-valuemin': '0',
    'aria-valuemax': '100',
    hidden: '',
  });
  readonly #revealText = createElement('span');
  readonly revealButton = createElement(
    'button',
    { class: 'reveal', part: 'button', type: 'button', hidden: '' },
    createElement('span', { class: 'panel' }, createIcon(LIGHT_ICON), this.#revealText),
  );
  /** The canvas and its layer. The view moves and magnifies them. */
  readonly content = createElement('div', { class: 'content' });
  readonly #picture = createElement('div', { part: 'picture' }, this.content);
  readonly #posterImage = createElement('img', { part: 'poster', alt: '', hidden: '' });
  readonly #poster = createElement('div', { class: 'poster' });
  readonly contentBox = createElement('div', { class: 'content-box' });
  readonly #spacer = createIcon('');
  readonly #overlay = createElement('div', { class: 'overlay' }, createSlot('overlay'));
  /** The box that shows the picture and receives pointer events. */
  readonly viewport = createElement('div', { class: 'viewport' });
  readonly #controls = createSlot('controls');
  readonly #progressBar = createElement('div', { class: 'progress-bar', role: 'progressbar' });
  readonly #progress = createElement('div', { class: 'progress', part: 'progress', hidden: '' });
  readonly #errorSummary = createElement('p');
  readonly retryButton = createElement('button', {
    class: 'retry',
    part: 'button retry',
    type: 'button',
  });
  readonly #detailsLabel = createElement('summary');
  readonly #errorDetails = createElement('p');
  readonly #message = createElement('div', {
    class: 'message',
    part: 'message',
    role: 'alert',
    hidden: '',
  });
  readonly #footer = createElement('div', { class: 'footer' });
  readonly #status = createElement('div', { part: 'status', role: 'status' });
  #canvas: HTMLCanvasElement | null = null;
  /** The last picture's size, so that the element keeps its place while another one loads. */
  #pictureSize: Size | null = null;
  /** The `width` and `height` attributes. */
  #requestedSize: Partial<Size> = {};
  #announceTimer: ReturnType<typeof setTimeout> | undefined;

  constructor(private readonly host: Element) {
    this.root = host.attachShadow({ mode: 'open' });
    adoptStyles(this.root, ELEMENT_CSS);
    const { viewport, handle, revealButton } = this;
    const image = this.#posterImage;
    image.addEventListener('load', () => this.#updateSpacer());
    image.addEventListener('error', () => {
      image.hidden = true;
    });
    this.#poster.append(createSlot('poster', image));
    viewport.append(this.#picture, this.#overlay, handle);
    const controls = createElement('div', { class: 'controls' }, this.#controls);
    this.#progress.append(createSlot('progress', this.#progressBar));
    const details = createElement('details', {}, this.#detailsLabel, this.#errorDetails);
    this.#message.append(createSlot('error', this.#errorSummary, this.retryButton, details));
    this.#footer.append(controls, this.#progress, this.#message);
    this.contentBox.append(viewport, this.#poster, revealButton, this.#footer);
    const paddingBox = createElement('div', { class: 'padding-box' }, this.contentBox);
    this.#spacer.setAttribute('class', 'spacer');
    this.root.append(paddingBox, this.#status);
    this.#updateSpacer();
  }

  /** Adds the built-in controls, which a page's own `controls` slot replaces. */
  mountControls(controls: readonly HTMLElement[], css: string): void {
    adoptStyles(this.root, css);
    this.#controls.append(...controls);
  }

  /** Labels everything for screen readers. An empty `alt` marks the picture as decorative. */
  updateLabels(alt: string | null, language: Language): void {
    updateAttribute(this.#picture, 'role', alt === '' ? 'presentation' : 'img');
    updateAttribute(this.#picture, 'aria-label', alt || null);
    const { handle, revealButton } = this;
    for (const part of [handle, revealButton, this.#footer, this.#status]) {
      part.lang = language;
    }
    updateAttribute(handle, 'aria-label', t('light', language));
    updateAttribute(handle, 'aria-roledescription', t('slider', language));
    updateAttribute(this.#progressBar, 'aria-label', t('loading', language));
    updateText(this.#revealText, t('reveal', language));
    updateText(this.#detailsLabel, t('details', language));
    updateText(this.retryButton, t('retry', language));
  }

  /** When the handle disappears, its focus moves to the viewport, which may be focusable itself without a handle. */
  updateLayout(
    hasHandle: boolean,
    isFocusable: boolean,
    touchAction: 'auto' | 'pan-y' | 'none',
    language: Language,
  ): void {
    const { handle, viewport } = this;
    const focused = this.root.activeElement;
    const keepsFocus = !hasHandle && (focused === handle || focused === viewport);
    handle.hidden = !hasHandle;
    viewport.classList.toggle('has-handle', hasHandle);
    viewport.style.setProperty('--touch-action', touchAction);
    const hasRole = isFocusable || keepsFocus;
    updateAttribute(viewport, 'tabindex', isFocusable ? '0' : keepsFocus ? '-1' : null);
    updateAttribute(viewport, 'role', hasRole ? 'group' : null);
    updateAttribute(viewport, 'aria-label', hasRole ? t('picture', language) : null);
    if (keepsFocus && focused === handle) viewport.focus({ preventScroll: true });
    if (hasHandle && focused === viewport) handle.focus({ preventScroll: true });
  }

  /** `layer` lies over the canvas; `size` is the picture's. */
  showCanvas(canvas: HTMLCanvasElement, layer: HTMLElement | undefined, size: Size): void {
    canvas.setAttribute('part', 'canvas');
    this.#canvas = canvas;
    this.content.replaceChildren(canvas, ...(layer ? [layer] : []));
    this.viewport.classList.add('has-picture');
    this.#pictureSize = size;
    this.#updateSpacer();
  }

  /** The size that the page requests by attributes. The photograph's or the poster's completes it. */
  requestSize(width: number | null, height: number | null): void {
    this.#requestedSize = { ...(width && { width }), ...(height && { height }) };
    this.#updateSpacer();
  }

  /** Applies `object-fit` and `object-position`, which the page may have changed. */
  updateFit(): void {
    placePicture(this.viewport, getComputedStyle(this.host));
  }

  /** The picture's box, in pixels from the element's top left corner; `null` without a picture. */
  get pictureBox(): DOMRectReadOnly | null {
    if (!this.#canvas) return null;
    const { left, top } = this.host.getBoundingClientRect();
    const box = this.viewport.getBoundingClientRect();
    return new DOMRectReadOnly(box.left - left, box.top - top, box.width, box.height);
  }

  /** The magnification that gives each pixel of the picture one of the screen; 1 without a picture. */
  get actualSizeZoom(): number {
    const pixels = devicePixelRatio * this.viewport.getBoundingClientRect().width;
    return (this.#pictureSize?.width ?? pixels) / pixels || 1;
  }

  /** Removes the canvas, the progress bar and the message. */
  clear(): void {
    this.viewport.classList.remove('has-picture');
    this.#canvas = null;
    this.content.replaceChildren();
    this.updateProgress(null);
    this.showError(null);
  }

  /** Shows a part of the picture. The handle is at the torch's position, or at the nearest edge of the view. */
  updateView(view: ZoomView, torch: PicturePoint): void {
    const { zoom } = view;
    this.viewport.classList.toggle('zoomed', zoom > 1);
    const shift = (centre: number) => `${100 * (0.5 - centre * zoom)}%`;
    this.content.style.transform =
      zoom > 1 ? `translate(${shift(view.x)}, ${shift(view.y)}) scale(${zoom})` : '';
    this.content.classList.toggle('pixelated', zoom > MIN_PIXELATED_ZOOM);
    const { x, y } = toViewport(view, torch);
    const percent = (coordinate: number) => `${100 * Math.min(1, Math.max(0, coordinate))}%`;
    const { style } = this.#overlay;
    style.width = style.height = `${100 * zoom}%`;
    style.left = shift(view.x);
    style.top = shift(view.y);
    this.handle.style.left = percent(x);
    this.handle.style.top = percent(y);
    updateAttribute(this.handle, 'aria-valuenow', String(Math.round(100 * torch.x)));
  }

  /** `needsPress` shows the button that dismisses the poster. */
  updatePoster(options: ElementOptions, isShown: boolean, needsPress: boolean): void {
    const image = this.#posterImage;
    const { poster, crossOrigin } = options;
    if (image.getAttribute('src') !== poster) {
      image.hidden = poster === null;
      updateAttribute(image, 'crossorigin', crossOrigin);
      updateAttribute(image, 'src', poster);
    }
    this.#poster.classList.toggle('hidden', !isShown);
    this.revealButton.hidden = !needsPress;
  }

  /** The loaded fraction, 0 to 1, or `NaN` if unknown; `null` hides the progress bar. */
  updateProgress(fraction: number | null): void {
    this.#progress.hidden = fraction === null;
    if (fraction === null) return;
    const isKnown = Number.isFinite(fraction);
    this.#progress.classList.toggle('indeterminate', !isKnown);
    this.#progressBar.style.transform = isKnown ? `scaleX(${fraction})` : '';
    const percent = isKnown ? String(Math.round(fraction * 100)) : null;
    updateAttribute(this.#progressBar, 'aria-valuenow', percent);
  }

  /** Shows a message over the picture; `null` hides it. */
  showError(details: string | null, summary = ''): void {
    const isRetryFocused = this.root.activeElement === this.retryButton;
    this.#message.hidden = details === null;
    if (details === null) {
      if (isRetryFocused) this.#keepFocus();
      return;
    }
    updateText(this.#errorSummary, summary);
    updateText(this.#errorDetails, details);
  }

  /** Keeps the keyboard's focus in the element when the focused button disappears. */
  #keepFocus(): void {
    this.contentBox.tabIndex = -1;
    this.contentBox.focus({ preventScroll: true });
  }

  /** Keeps the place of the picture on the page. */
  #updateSpacer(): void {
    const { naturalWidth, naturalHeight } = this.#posterImage;
    const posterSize = naturalWidth > 0 ? { width: naturalWidth, height: naturalHeight } : null;
    const natural = this.#pictureSize ?? posterSize ?? UNKNOWN_SIZE;
    const requested = this.#requestedSize;
    const ratio = natural.width / natural.height;
    const width = requested.width ?? (requested.height ?? natural.height) * ratio;
    const height = requested.height ?? width / ratio;
    const viewBox = `0 0 ${width} ${height}`;
    if (this.#spacer.getAttribute('viewBox') !== viewBox) {
      this.#spacer.setAttribute('viewBox', viewBox);
      this.#spacer.setAttribute('width', String(width));
      this.#spacer.setAttribute('height', String(height));
      // WebKit keeps the width of a float around it otherwise.
      this.root.prepend(this.#spacer);
    }
    const shown = this.#pictureSize ?? { width, height };
    const { style } = this.viewport;
    style.setProperty('--_natural-width', String(shown.width));
    style.setProperty('--_natural-height', String(shown.height));
  }

  /** Has a screen reader read a text, unless another one follows at once. */
  announce(text: string): void {
    clearTimeout(this.#announceTimer);
    this.#announceTimer = setTimeout(() => updateText(this.#status, text), ANNOUNCE_DELAY_MS);
  }
}
