/** The element's shadow DOM: the viewport with picture, poster and torch handle; controls, progress bar and message. */

import { type Language, t } from '../i18n/translations.js';
import type { PicturePoint } from '../shared/value-types.js';
import type { ElementOptions } from '../state/options.js';
import { toViewport, type ZoomView } from '../state/viewport.js';
import { adoptStyles } from './adopted-styles.js';
import { createElement, createSlot, updateAttribute, updateText } from './dom-helpers.js';
import { createIcon, LIGHT_ICON } from './icons.js';
import ELEMENT_CSS from './style.css';

/** Beyond this zoom, pixels are drawn as squares. */
const MIN_PIXELATED_ZOOM = 4;
/** An announcement waits this long, so that a newer one can replace it. */
const ANNOUNCE_DELAY_MS = 400;
const HINT_MS = 1800;

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
  readonly #picture = createElement('div', { part: 'picture' });
  readonly #posterImage = createElement('img', { part: 'poster', alt: '', hidden: '' });
  readonly #poster = createElement('div', { class: 'poster' });
  readonly #hint = createElement('div', { class: 'hint panel', part: 'hint', hidden: '' });
  /** The box that shows the picture and receives pointer events. */
  readonly viewport = createElement('div', { class: 'viewport' });
  readonly #controls = createSlot('controls');
  readonly #progressBar = createElement('div', { class: 'progress-bar', role: 'progressbar' });
  readonly #progress = createElement('div', { class: 'progress', part: 'progress', hidden: '' });
  readonly #errorSummary = createElement('p');
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
  #announceTimer: ReturnType<typeof setTimeout> | undefined;
  #hintTimer: ReturnType<typeof setTimeout> | undefined;

  constructor(host: Element) {
    this.root = host.attachShadow({ mode: 'open' });
    adoptStyles(this.root, ELEMENT_CSS);
    const { viewport, handle, revealButton } = this;
    const image = this.#posterImage;
    image.addEventListener('load', () => viewport.classList.add('has-poster'));
    image.addEventListener('error', () => {
      image.hidden = true;
    });
    this.#poster.append(createSlot('poster', image));
    viewport.append(this.#picture, this.#poster, handle, revealButton, this.#hint);
    const controls = createElement('div', { class: 'controls' }, this.#controls);
    this.#progress.append(createSlot('progress', this.#progressBar));
    const details = createElement('details', {}, this.#detailsLabel, this.#errorDetails);
    this.#message.append(createSlot('error', this.#errorSummary, details));
    this.#footer.append(controls, this.#progress, this.#message);
    this.root.append(viewport, this.#footer, this.#status);
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
    for (const part of [handle, revealButton, this.#hint, this.#footer, this.#status]) {
      part.lang = language;
    }
    updateAttribute(handle, 'aria-label', t('light', language));
    updateAttribute(handle, 'aria-roledescription', t('slider', language));
    updateAttribute(this.#progressBar, 'aria-label', t('loading', language));
    updateText(this.#revealText, t('reveal', language));
    updateText(this.#detailsLabel, t('details', language));
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

  showCanvas(canvas: HTMLCanvasElement): void {
    canvas.setAttribute('part', 'canvas');
    this.#canvas = canvas;
    this.#picture.replaceChildren(canvas);
    this.viewport.classList.add('has-picture');
    this.viewport.style.setProperty('--ratio', String(canvas.width / canvas.height));
  }

  /** Removes the canvas, the progress bar and the message. */
  clear(): void {
    this.viewport.classList.remove('has-picture');
    this.#canvas = null;
    this.#picture.replaceChildren();
    this.updateProgress(null);
    this.showError(null);
  }

  /** Shows a part of the picture. The handle is at the torch's position, or at the nearest edge of the view. */
  updateView(view: ZoomView, torch: PicturePoint, description: string): void {
    const { zoom } = view;
    this.viewport.classList.toggle('zoomed', zoom > 1);
    if (this.#canvas) {
      const shift = (centre: number) => `${100 * (0.5 - centre * zoom)}%`;
      this.#canvas.style.transform =
        zoom > 1 ? `translate(${shift(view.x)}, ${shift(view.y)}) scale(${zoom})` : '';
      this.#canvas.classList.toggle('pixelated', zoom > MIN_PIXELATED_ZOOM);
    }
    const { x, y } = toViewport(view, torch);
    const percent = (coordinate: number) => `${100 * Math.min(1, Math.max(0, coordinate))}%`;
    this.handle.style.left = percent(x);
    this.handle.style.top = percent(y);
    updateAttribute(this.handle, 'aria-valuenow', String(Math.round(100 * torch.x)));
    updateAttribute(this.handle, 'aria-valuetext', description);
  }

  /** `needsPress` shows the button that dismisses the poster. */
  updatePoster(options: ElementOptions, isShown: boolean, needsPress: boolean): void {
    const image = this.#posterImage;
    const { poster, crossOrigin } = options;
    if (image.getAttribute('src') !== poster) {
      this.viewport.classList.remove('has-poster');
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
    this.#message.hidden = details === null;
    if (details === null) return;
    updateText(this.#errorSummary, summary);
    updateText(this.#errorDetails, details);
  }

  showHint(text: string): void {
    updateText(this.#hint, text);
    this.#hint.hidden = false;
    clearTimeout(this.#hintTimer);
    this.#hintTimer = setTimeout(() => {
      this.#hint.hidden = true;
    }, HINT_MS);
  }

  /** Has a screen reader read a text, unless another one follows at once. */
  announce(text: string): void {
    clearTimeout(this.#announceTimer);
    this.#announceTimer = setTimeout(() => updateText(this.#status, text), ANNOUNCE_DELAY_MS);
  }
}
