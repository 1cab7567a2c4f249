/**
 * The toolbar and the light menu. The toolbar is a single tab stop; the arrow keys move between its buttons. A
 * separate script, which is fetched only for pages that use `controls`.
 */

import type { StringKey } from '../i18n/strings.js';
import type { LightItem } from '../state/light-state.js';
import { createElement, updateAttribute, updateText } from './dom-helpers.js';
import { createIcon, LIGHT_ICON, setIcon } from './icons.js';
import TOOLBAR_CSS from './toolbar.css';

/** The state that the buttons show; `null` hides a button. */
export interface ToolbarState {
  /** A text in the visitor's language. */
  readonly t: (key: StringKey) => string;
  /** Changes whenever the texts do. */
  readonly languageKey: string;
  readonly items: readonly LightItem[];
  readonly item: LightItem;
  readonly isPlaying: boolean | null;
  readonly zoom: { readonly canZoomIn: boolean; readonly canZoomOut: boolean } | null;
  readonly isTilting: boolean | null;
  readonly isFullscreen: boolean | null;
}

type ActionName = 'play' | 'zoomOut' | 'zoomIn' | 'reset' | 'tilt' | 'fullscreen';

/** The actions of the buttons and the menu. */
export interface ToolbarActions extends Readonly<Record<ActionName, () => void>> {
  readonly selectLight: (item: LightItem) => void;
}

type ButtonName = 'light' | ActionName;

const MAGNIFIER = 'M10.5 4a6.5 6.5 0 1 0 0 13a6.5 6.5 0 1 0 0-13M15.3 15.3L20 20M8 10.5h5';

const ICONS = {
  light: LIGHT_ICON,
  play: 'M8.5 5.5v13l10-6.5z',
  pause: 'M9 6v12M15 6v12',
  zoomIn: `${MAGNIFIER}M10.5 8v5`,
  zoomOut: MAGNIFIER,
  reset: 'M5 12a7 7 0 1 0 2-4.9L5 9M5 4.5V9h4.5',
  tilt:
    'M8.5 4.5h7a1 1 0 0 1 1 1v13a1 1 0 0 1-1 1h-7a1 1 0 0 1-1-1v-13a1 1 0 0 1 1-1z' +
    'M4 9l-1.5 3L4 15M20 9l1.5 3L20 15',
  fullscreen: 'M5 9.5V5h4.5M14.5 5H19v4.5M19 14.5V19h-4.5M9.5 19H5v-4.5',
  leaveFullscreen: 'M9.5 5v4.5H5M19 9.5h-4.5V5M14.5 19v-4.5H19M5 14.5h4.5V19',
} as const;

type IconName = keyof typeof ICONS;

/** The toolbar hides after this time without pointer movement. */
const HIDE_MS = 3000;

export class Toolbar {
  readonly css = TOOLBAR_CSS;
  readonly bar: HTMLElement;
  readonly menu: HTMLElement;
  readonly #buttons: Readonly<Record<ButtonName, HTMLButtonElement>>;
  readonly #lightName = createElement('span');
  /** The items and the language of the current menu. */
  #menuKey = '';
  #hideTimer: ReturnType<typeof setTimeout> | undefined;

  constructor(actions: ToolbarActions) {
    this.#buttons = {
      light: createButton('light', () => this.#setMenuOpen(this.menu.hidden === true)),
      play: createButton('play', actions.play),
      zoomOut: createButton('zoomOut', actions.zoomOut),
      zoomIn: createButton('zoomIn', actions.zoomIn),
      reset: createButton('reset', actions.reset),
      tilt: createButton('tilt', actions.tilt),
      fullscreen: createButton('fullscreen', actions.fullscreen),
    };
    this.#buttons.light.append(this.#lightName);
    updateAttribute(this.#buttons.light, 'aria-controls', 'lights');
    this.bar = createElement(
      'div',
      { class: 'toolbar', part: 'controls', role: 'toolbar' },
      ...Object.values(this.#buttons),
    );
    this.menu = createElement('div', {
      class: 'menu',
      part: 'menu',
      role: 'radiogroup',
      id: 'lights',
    });
    this.closeMenu();
    this.bar.addEventListener('keydown', (event) => this.#moveFocus(event));
    this.bar.addEventListener('focusin', ({ target }) => this.#setTabStop(target));
    this.menu.addEventListener('change', ({ target }) => {
      if (target instanceof HTMLInputElement) actions.selectLight(target.value as LightItem);
    });
    this.menu.addEventListener('keydown', (event) => {
      if (event.key !== 'Escape') return;
      event.preventDefault();
      this.closeMenu();
      this.#buttons.light.focus();
    });
  }

  /** `null` hides the toolbar. */
  update(state: ToolbarState | null): void {
    this.bar.hidden = state === null;
    if (!state) {
      this.closeMenu();
      return;
    }
    const { t, item, isPlaying, zoom, isTilting, isFullscreen } = state;
    const { light, zoomOut, zoomIn, tilt } = this.#buttons;
    const show = (name: ButtonName, isVisible: boolean, icon: IconName = name) => {
      const button = this.#buttons[name];
      button.hidden = !isVisible;
      setLabel(button, t(icon));
      if (button.firstElementChild) setIcon(button.firstElementChild, ICONS[icon]);
    };
    this.#updateMenu(state);
    for (const input of this.menu.querySelectorAll('input')) input.checked = input.value === item;
    updateAttribute(this.bar, 'aria-label', t('controls'));
    updateAttribute(this.menu, 'aria-label', t('light'));
    updateText(this.#lightName, t(item));
    setLabel(light, `${t('light')}: ${t(item)}`);
    show('play', isPlaying !== null, isPlaying ? 'pause' : 'play');
    show('zoomOut', zoom !== null);
    show('zoomIn', zoom !== null);
    updateAttribute(zoomOut, 'aria-disabled', String(!zoom?.canZoomOut));
    updateAttribute(zoomIn, 'aria-disabled', String(!zoom?.canZoomIn));
    show('reset', true);
    show('tilt', isTilting !== null);
    updateAttribute(tilt, 'aria-pressed', String(isTilting === true));
    show('fullscreen', isFullscreen !== null, isFullscreen ? 'leaveFullscreen' : 'fullscreen');
    // The button that was the tab stop may be hidden now.
    const stops = this.#visibleButtons.filter((button) => button.tabIndex === 0);
    if (stops.length !== 1) this.#setTabStop(light);
  }

  closeMenu(): void {
    this.#setMenuOpen(false);
  }

  /** Shows the toolbar: for good after a key press, otherwise for `HIDE_MS`. */
  show(byKeyboard: boolean): void {
    this.bar.classList.remove('idle');
    clearTimeout(this.#hideTimer);
    if (byKeyboard) return;
    this.#hideTimer = setTimeout(() => {
      if (this.menu.hidden) this.bar.classList.add('idle');
    }, HIDE_MS);
  }

  get #visibleButtons(): HTMLButtonElement[] {
    return Object.values(this.#buttons).filter((button) => !button.hidden);
  }

  #setMenuOpen(isOpen: boolean): void {
    this.menu.hidden = !isOpen;
    updateAttribute(this.#buttons.light, 'aria-expanded', String(isOpen));
    if (isOpen) this.menu.querySelector<HTMLInputElement>('input:checked')?.focus();
  }

  #updateMenu({ items, languageKey, t }: ToolbarState): void {
    const key = `${items} ${languageKey}`;
    if (key === this.#menuKey) return;
    this.#menuKey = key;
    const labels = items.map((item) => {
      const input = createElement('input', { type: 'radio', name: 'light', value: item });
      return createElement('label', {}, input, createElement('span', {}, t(item)));
    });
    this.menu.replaceChildren(...labels);
  }

  #setTabStop(target: EventTarget | null): void {
    for (const button of this.#visibleButtons) button.tabIndex = button === target ? 0 : -1;
  }

  #moveFocus(event: KeyboardEvent): void {
    const buttons = this.#visibleButtons;
    const current = buttons.indexOf(event.target as HTMLButtonElement);
    const next = {
      ArrowLeft: current - 1,
      ArrowRight: current + 1,
      Home: 0,
      End: buttons.length - 1,
    }[event.key];
    if (current < 0 || next === undefined) return;
    event.preventDefault();
    buttons[(next + buttons.length) % buttons.length]?.focus();
  }
}

function createButton(iconName: IconName, onPress: () => void): HTMLButtonElement {
  const button = createElement(
    'button',
    { part: 'button', type: 'button' },
    createIcon(ICONS[iconName]),
  );
  button.addEventListener('click', () => {
    if (button.getAttribute('aria-disabled') !== 'true') onPress();
  });
  return button;
}

function setLabel(button: HTMLButtonElement, label: string): void {
  updateAttribute(button, 'aria-label', label);
  updateAttribute(button, 'title', label);
}
