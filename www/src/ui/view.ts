/** What is inside the element's shadow: the picture and its poster, the light's handle, a progress bar, a
 * message, and the place of the controls. Holds no state that is not on the screen. */

import { type Language, say } from '../i18n/strings.js';
import type { PicturePoint } from '../shared/values.js';
import { type PhotoView, toBox } from '../state/viewport.js';
import { adopt } from './adopted-styles.js';
import { make, put, slot, write } from './dom.js';
import { icon, LAMP } from './icons.js';
import STYLE from './style.css';

/** What is wrong, for visitors and for who is to mend it. */
export interface Fault {
  /** Whether there is no picture for it. */
  readonly fatal: boolean;
  readonly message: string;
}

/** What the picture is to whoever touches it. */
export interface StageState {
  /** A light can be taken along. */
  readonly light: boolean;
  /** The keyboard needs the picture itself, as there is no light to take. */
  readonly focusable: boolean;
  readonly zoomed: boolean;
  /** Whether single fingers are left to the page's scrolling up and down, or to nothing but the picture. */
  readonly touch: 'page' | 'scroll' | 'hold';
}

/** Beyond it, pixels are shown as such. */
const PIXELS_FROM = 4;
/** How long what is read out waits for what follows at once. */
const SETTLES_MS = 400;
const HINT_MS = 1800;

/** See the module. */
export class View {
  /** The picture's box; takes pointers. */
  readonly stage = make('div', { name: 'stage' });
  /** The light, for the keyboard. */
  readonly handle = make('div', {
    name: 'handle',
    part: 'torch-handle',
    attributes: { role: 'slider', tabindex: '0', 'aria-valuemin': '0', 'aria-valuemax': '100' },
  });
  /** Has the poster give way. */
  readonly revealButton: HTMLButtonElement;
  readonly #controls = slot('controls');
  readonly #picture = make('div', { name: 'picture', part: 'picture' });
  readonly #poster: HTMLElement;
  readonly #posterImage = make('img', { part: 'poster', attributes: { alt: '' } });
  readonly #revealText = make('span');
  readonly #hint = make('div', { name: 'hint', part: 'hint' });
  readonly #bar = make('div', { name: 'bar', attributes: { role: 'progressbar' } });
  readonly #progress: HTMLElement;
  readonly #foot = make('div', { name: 'foot' });
  readonly #message: HTMLElement;
  readonly #short = make('p');
  readonly #summary = make('summary');
  readonly #long = make('p');
  readonly #status = make('div', {
    name: 'unseen',
    part: 'status',
    attributes: { role: 'status' },
  });
  readonly #root: ShadowRoot;
  #canvas: HTMLCanvasElement | null = null;
  #telling: ReturnType<typeof setTimeout> | undefined;
  #hinting: ReturnType<typeof setTimeout> | undefined;

  constructor(root: ShadowRoot) {
    this.#root = root;
    adopt(root, STYLE);
    this.#poster = make('div', { name: 'poster' }, slot('poster', this.#posterImage));
    this.#posterImage.addEventListener('load', () => this.stage.classList.add('postered'));
    // One that cannot be had leaves its place empty.
    this.#posterImage.addEventListener('error', () => {
      this.#posterImage.hidden = true;
    });
    this.revealButton = make(
      'button',
      { name: 'reveal', part: 'button', attributes: { type: 'button' } },
      make('span', {}, icon(LAMP), this.#revealText),
    );
    this.stage.append(this.#picture, this.#poster, this.handle, this.revealButton, this.#hint);
    this.#progress = make('div', { name: 'progress', part: 'progress' });
    this.#progress.append(slot('progress', this.#bar));
    this.#message = make(
      'div',
      { name: 'message', part: 'message', attributes: { role: 'alert' } },
      slot('error', this.#short, make('details', {}, this.#summary, this.#long)),
    );
    this.#posterImage.hidden = true;
    for (const part of [this.handle, this.revealButton, this.#hint, this.#progress, this.#message])
      part.hidden = true;
    this.#foot.append(
      make('div', { name: 'controls' }, this.#controls),
      this.#progress,
      this.#message,
    );
    root.append(this.stage, this.#foot, this.#status);
  }

  /** Puts in what is there unless a page has controls of its own. */
  furnish(controls: readonly HTMLElement[], style: string): void {
    adopt(this.#root, style);
    this.#controls.append(...controls);
  }

  /** Names things, for those who cannot see them. An empty text marks a picture as decoration. */
  describe(alt: string | null, language: Language): void {
    put(this.#picture, 'role', alt === '' ? 'presentation' : 'img');
    put(this.#picture, 'aria-label', alt || null);
    for (const part of [this.handle, this.revealButton, this.#hint, this.#foot, this.#status]) {
      part.lang = language;
    }
    put(this.handle, 'aria-label', say('light', language));
    put(this.handle, 'aria-roledescription', say('slider', language));
    put(this.#bar, 'aria-label', say('loading', language));
    write(this.#revealText, say('reveal', language));
    write(this.#summary, say('details', language));
  }

  /** Under a light that does not move there is no handle; who holds it is left with the picture. */
  arrange({ light, focusable, zoomed, touch }: StageState, language: Language): void {
    const { handle, stage } = this;
    const active = this.#root.activeElement;
    const keeps = !light && (active === handle || active === stage);
    handle.hidden = !light;
    stage.classList.toggle('light', light);
    stage.classList.toggle('zoomed', zoomed);
    stage.classList.toggle('scrolls', touch === 'scroll');
    stage.classList.toggle('holds', touch === 'hold');
    const named = focusable || keeps;
    put(stage, 'tabindex', focusable ? '0' : keeps ? '-1' : null);
    put(stage, 'role', named ? 'group' : null);
    put(stage, 'aria-label', named ? say('picture', language) : null);
    if (keeps && active === handle) stage.focus({ preventScroll: true });
    if (light && active === stage) handle.focus({ preventScroll: true });
  }

  /** Shows a canvas in place of the last one. */
  show(canvas: HTMLCanvasElement): void {
    canvas.setAttribute('part', 'canvas');
    this.#canvas = canvas;
    this.#picture.replaceChildren(canvas);
    this.stage.classList.add('filled');
    this.stage.style.setProperty('--ratio', String(canvas.width / canvas.height));
  }

  /** Takes the picture away. */
  clear(): void {
    this.stage.classList.remove('filled');
    this.#canvas = null;
    this.#picture.replaceChildren();
    this.progress(null);
    this.fault(null, 'en');
  }

  /** Shows a part of the picture, and the light where it is in it, or at the edge it is beyond. */
  place(view: PhotoView, light: PicturePoint, words: string): void {
    if (this.#canvas) {
      const { zoom, x, y } = view;
      const shift = (at: number) => `${100 * (0.5 - at * zoom)}%`;
      this.#canvas.style.transform =
        zoom > 1 ? `translate(${shift(x)}, ${shift(y)}) scale(${zoom})` : '';
      this.#canvas.classList.toggle('pixels', zoom > PIXELS_FROM);
    }
    const { x, y } = toBox(view, light);
    const within = (at: number) => `${100 * Math.min(1, Math.max(0, at))}%`;
    this.handle.style.left = within(x);
    this.handle.style.top = within(y);
    put(this.handle, 'aria-valuenow', String(Math.round(100 * light.x)));
    put(this.handle, 'aria-valuetext', words);
  }

  /** Shows a poster, or lets it go; `pressed` waits for somebody to press it. */
  poster(src: string | null, crossOrigin: string | null, shown: boolean, pressed: boolean): void {
    if (this.#posterImage.getAttribute('src') !== src) {
      this.stage.classList.remove('postered');
      this.#posterImage.hidden = src === null;
      put(this.#posterImage, 'crossorigin', crossOrigin);
      put(this.#posterImage, 'src', src);
    }
    this.#poster.classList.toggle('gone', !shown);
    this.revealButton.hidden = !pressed;
  }

  /** Shows how far a load has come, from 0 to 1, `NaN` where that is not known; `null` hides it. */
  progress(fraction: number | null): void {
    this.#progress.hidden = fraction === null;
    if (fraction === null) return;
    const known = Number.isFinite(fraction);
    this.#progress.classList.toggle('unknown', !known);
    this.#bar.style.transform = known ? `scaleX(${fraction})` : '';
    put(this.#bar, 'aria-valuenow', known ? String(Math.round(fraction * 100)) : null);
  }

  /** Shows a message over the picture; `null` takes it away. */
  fault(fault: Fault | null, language: Language): void {
    if (fault) {
      write(this.#short, say(fault.fatal ? 'broken' : 'flawed', language));
      write(this.#long, fault.message);
    }
    this.#message.hidden = fault === null;
  }

  /** Shows for a moment how something is done. */
  hint(text: string): void {
    write(this.#hint, text);
    this.#hint.hidden = false;
    clearTimeout(this.#hinting);
    this.#hinting = setTimeout(() => {
      this.#hint.hidden = true;
    }, HINT_MS);
  }

  /** Has something read out, unless something else follows at once. */
  tell(text: string): void {
    clearTimeout(this.#telling);
    this.#telling = setTimeout(() => write(this.#status, text), SETTLES_MS);
  }
}
