/**
 * The buttons: one stop of the tab key, left and right between them; and the list of lights. A file of its
 * own, for pages that ask for controls.
 */

import type { Word } from '../i18n/strings.js';
import type { LightItem } from '../state/lighting.js';
import { make, put, write } from './dom.js';
import { icon, LAMP, showIcon } from './icons.js';
import STYLE from './toolbar.css';

/** What the buttons show. `null`: there is no such button. */
export interface ToolbarState {
  /** A text in the visitor's language, which it is called by as well. */
  readonly say: (word: Word) => string;
  readonly language: string;
  readonly items: readonly LightItem[];
  readonly item: LightItem;
  readonly plays: boolean | null;
  /** Whether there is more or less to be had. */
  readonly zoom: { readonly in: boolean; readonly out: boolean } | null;
  readonly tilts: boolean | null;
  readonly fullscreen: boolean | null;
}

/** What the buttons do. */
export interface ToolbarActions {
  choose(item: LightItem): void;
  play(): void;
  zoom(by: 1 | -1): void;
  reset(): void;
  tilt(): void;
  fullscreen(): void;
}

const LENS = 'M10.5 4a6.5 6.5 0 1 0 0 13a6.5 6.5 0 1 0 0-13M15.3 15.3L20 20M8 10.5h5';

const ICONS = {
  light: LAMP,
  play: 'M8.5 5.5v13l10-6.5z',
  pause: 'M9 6v12M15 6v12',
  zoomIn: `${LENS}M10.5 8v5`,
  zoomOut: LENS,
  reset: 'M5 12a7 7 0 1 0 2-4.9L5 9M5 4.5V9h4.5',
  tilt:
    'M8.5 4.5h7a1 1 0 0 1 1 1v13a1 1 0 0 1-1 1h-7a1 1 0 0 1-1-1v-13a1 1 0 0 1 1-1z' +
    'M4 9l-1.5 3L4 15M20 9l1.5 3L20 15',
  fullscreen: 'M5 9.5V5h4.5M14.5 5H19v4.5M19 14.5V19h-4.5M9.5 19H5v-4.5',
  leaveFullscreen: 'M9.5 5v4.5H5M19 9.5h-4.5V5M14.5 19v-4.5H19M5 14.5h4.5V19',
} as const;

type IconName = keyof typeof ICONS;

/** Who has moved no pointer for so long looks at the picture. */
const REST_MS = 3000;

/** See the module. */
export class Toolbar {
  readonly style = STYLE;
  readonly bar: HTMLElement;
  readonly menu: HTMLElement;
  readonly #light: HTMLButtonElement;
  readonly #lightName = make('span');
  readonly #play: HTMLButtonElement;
  readonly #zoomOut: HTMLButtonElement;
  readonly #zoomIn: HTMLButtonElement;
  readonly #reset: HTMLButtonElement;
  readonly #tilt: HTMLButtonElement;
  readonly #fullscreen: HTMLButtonElement;
  #shown = '';
  #resting: ReturnType<typeof setTimeout> | undefined;

  constructor(actions: ToolbarActions) {
    this.#light = button('light', () => this.#open(this.menu.hidden === true));
    this.#light.append(this.#lightName);
    put(this.#light, 'aria-controls', 'lights');
    this.#play = button('play', () => actions.play());
    this.#zoomOut = button('zoomOut', () => actions.zoom(-1));
    this.#zoomIn = button('zoomIn', () => actions.zoom(1));
    this.#reset = button('reset', () => actions.reset());
    this.#tilt = button('tilt', () => actions.tilt());
    this.#fullscreen = button('fullscreen', () => actions.fullscreen());
    this.bar = make(
      'div',
      { name: 'toolbar', part: 'controls', attributes: { role: 'toolbar' } },
      this.#light,
      this.#play,
      this.#zoomOut,
      this.#zoomIn,
      this.#reset,
      this.#tilt,
      this.#fullscreen,
    );
    this.menu = make('div', {
      name: 'menu',
      part: 'menu',
      attributes: { role: 'radiogroup', id: 'lights' },
    });
    this.close();
    this.bar.addEventListener('keydown', (event) => this.#rove(event));
    this.bar.addEventListener('focusin', ({ target }) => this.#stopAt(target));
    this.menu.addEventListener('change', ({ target }) => {
      if (target instanceof HTMLInputElement) actions.choose(target.value as LightItem);
    });
    this.menu.addEventListener('keydown', (event) => {
      if (event.key !== 'Escape') return;
      event.preventDefault();
      this.close();
      this.#light.focus();
    });
  }

  update({ say, language, items, item, plays, zoom, tilts, fullscreen }: ToolbarState): void {
    this.#list(items, language, say);
    for (const input of this.menu.querySelectorAll('input')) input.checked = input.value === item;
    put(this.bar, 'aria-label', say('controls'));
    put(this.menu, 'aria-label', say('light'));
    write(this.#lightName, say(item));
    name(this.#light, `${say('light')}: ${say(item)}`);
    show(this.#play, plays !== null, say(plays ? 'pause' : 'play'), plays ? 'pause' : 'play');
    show(this.#zoomOut, zoom !== null, say('zoomOut'));
    show(this.#zoomIn, zoom !== null, say('zoomIn'));
    put(this.#zoomOut, 'aria-disabled', String(!zoom?.out));
    put(this.#zoomIn, 'aria-disabled', String(!zoom?.in));
    show(this.#reset, true, say('reset'));
    show(this.#tilt, tilts !== null, say('tilt'));
    put(this.#tilt, 'aria-pressed', String(tilts === true));
    const screen = fullscreen ? 'leaveFullscreen' : 'fullscreen';
    show(this.#fullscreen, fullscreen !== null, say(screen), screen);
    // The one stop may have gone.
    const stops = this.#buttons.filter((button) => button.tabIndex === 0);
    if (stops.length !== 1) this.#stopAt(this.#light);
  }

  close(): void {
    this.#open(false);
  }

  /** Somebody moves a pointer over the picture: the buttons show, and go once it rests. */
  wake(): void {
    this.bar.classList.remove('resting');
    clearTimeout(this.#resting);
    this.#resting = setTimeout(() => {
      if (this.menu.hidden) this.bar.classList.add('resting');
    }, REST_MS);
  }

  /** Somebody uses keys: the buttons stay. */
  stay(): void {
    clearTimeout(this.#resting);
    this.bar.classList.remove('resting');
  }

  get #buttons(): HTMLButtonElement[] {
    return [...this.bar.querySelectorAll('button')].filter((button) => !button.hidden);
  }

  #open(open: boolean): void {
    this.menu.hidden = !open;
    put(this.#light, 'aria-expanded', String(open));
    if (open) this.menu.querySelector<HTMLInputElement>('input:checked')?.focus();
  }

  #list(items: readonly LightItem[], language: string, say: (word: Word) => string): void {
    const shown = `${items} ${language}`;
    if (shown === this.#shown) return;
    this.#shown = shown;
    const labels = items.map((item) => {
      const attributes = { type: 'radio', name: 'light', value: item };
      return make('label', {}, make('input', { attributes }), make('span', {}, say(item)));
    });
    this.menu.replaceChildren(...labels);
  }

  #stopAt(target: EventTarget | null): void {
    for (const button of this.#buttons) button.tabIndex = button === target ? 0 : -1;
  }

  #rove(event: KeyboardEvent): void {
    const buttons = this.#buttons;
    const at = buttons.indexOf(event.target as HTMLButtonElement);
    const to = {
      ArrowLeft: at - 1,
      ArrowRight: at + 1,
      Home: 0,
      End: buttons.length - 1,
    }[event.key];
    if (at < 0 || to === undefined) return;
    event.preventDefault();
    buttons[(to + buttons.length) % buttons.length]?.focus();
  }
}

function button(iconName: IconName, press: () => void): HTMLButtonElement {
  const made = make(
    'button',
    { part: 'button', attributes: { type: 'button' } },
    icon(ICONS[iconName]),
  );
  made.addEventListener('click', () => {
    if (made.getAttribute('aria-disabled') !== 'true') press();
  });
  return made;
}

function name(button: HTMLButtonElement, text: string): void {
  put(button, 'aria-label', text);
  put(button, 'title', text);
}

function show(button: HTMLButtonElement, shown: boolean, text: string, iconName?: IconName): void {
  button.hidden = !shown;
  name(button, text);
  if (iconName && button.firstElementChild) showIcon(button.firstElementChild, ICONS[iconName]);
}
