/** The toolbar, a single tab stop whose buttons the arrow keys focus, and the light menu. It is a separate script. */

import type { StringKey } from '../i18n/translations.js';
import type { LightMenuItem } from '../state/light-state.js';
import type { ViewerState } from '../state/viewer-state.js';
import { createElement, updateAttribute, updateText } from './dom-helpers.js';
import { createIcon, LIGHT_ICON, setIcon } from './icons.js';
import TOOLBAR_CSS from './toolbar.css';

export interface ToolbarActions {
  selectLight(item: LightMenuItem): void;
  play(): void;
  zoom(by: 1 | -1): void;
  reset(): void;
  tilt(): void;
}

type ButtonName = 'light' | 'play' | 'zoomOut' | 'zoomIn' | 'reset' | 'tilt' | 'fullscreen';

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
  #menuTexts = '';
  #hideTimer: ReturnType<typeof setTimeout> | undefined;

  constructor(
    private readonly host: Element,
    private readonly viewer: ViewerState,
    actions: ToolbarActions,
  ) {
    this.#buttons = {
      light: createButton('light', () => this.#setMenuOpen(this.menu.hidden === true)),
      play: createButton('play', actions.play),
      zoomOut: createButton('zoomOut', () => actions.zoom(-1)),
      zoomIn: createButton('zoomIn', () => actions.zoom(1)),
      reset: createButton('reset', actions.reset),
      tilt: createButton('tilt', actions.tilt),
      fullscreen: createButton('fullscreen', () => this.#toggleFullscreen()),
    };
    this.#buttons.light.append(this.#lightName);
    updateAttribute(this.#buttons.light, 'aria-controls', 'lights');
    const barAttributes = { class: 'toolbar panel', part: 'controls', role: 'toolbar' };
    this.bar = createElement('div', barAttributes, ...Object.values(this.#buttons));
    const menuAttributes = { class: 'menu panel', part: 'menu', role: 'radiogroup', id: 'lights' };
    this.menu = createElement('div', menuAttributes);
    this.closeMenu();
    this.bar.addEventListener('keydown', (event) => this.#moveFocus(event));
    this.bar.addEventListener('focusin', ({ target }) => this.#setTabStop(target));
    this.menu.addEventListener('change', ({ target }) => {
      if (target instanceof HTMLInputElement) actions.selectLight(target.value as LightMenuItem);
    });
    this.menu.addEventListener('keydown', (event) => {
      if (event.key !== 'Escape') return;
      event.preventDefault();
      this.closeMenu();
      this.#buttons.light.focus();
    });
  }

  hide(): void {
    this.bar.hidden = true;
    this.closeMenu();
  }

  /** Shows the viewer's state in the language of `t`. `isTilting` is `null` if the torch cannot follow the tilt. */
  update(t: (key: StringKey) => string, isPaused: boolean, isTilting: boolean | null): void {
    this.bar.hidden = false;
    const { light: lightState, options, view } = this.viewer;
    const { item, items } = lightState;
    const isPlayable = lightState.isPlayable || (lightState.isTorch && options.autoplayLight);
    const zooms = options.maxZoom > 1;
    const { light, zoomOut, zoomIn, tilt } = this.#buttons;
    const show = (name: ButtonName, isVisible: boolean, icon: IconName = name) => {
      const button = this.#buttons[name];
      button.hidden = !isVisible;
      setLabel(button, t(icon));
      if (button.firstElementChild) setIcon(button.firstElementChild, ICONS[icon]);
    };
    this.#updateMenu(items, items.map(t));
    for (const input of this.menu.querySelectorAll('input')) input.checked = input.value === item;
    updateAttribute(this.bar, 'aria-label', t('controls'));
    updateAttribute(this.menu, 'aria-label', t('light'));
    updateText(this.#lightName, t(item));
    setLabel(light, `${t('light')}: ${t(item)}`);
    show('play', isPlayable, isPaused ? 'play' : 'pause');
    show('zoomOut', zooms);
    show('zoomIn', zooms);
    updateAttribute(zoomOut, 'aria-disabled', String(view.zoom <= 1));
    updateAttribute(zoomIn, 'aria-disabled', String(view.zoom >= options.maxZoom));
    show('reset', true);
    show('tilt', isTilting !== null);
    updateAttribute(tilt, 'aria-pressed', String(isTilting === true));
    const fullscreenIcon = this.#isFullscreen ? 'leaveFullscreen' : 'fullscreen';
    show('fullscreen', document.fullscreenEnabled, fullscreenIcon);
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

  get #isFullscreen(): boolean {
    return this.host.matches(':fullscreen');
  }

  /** Does nothing where the browser, an enclosing frame or the visitor refuses. */
  #toggleFullscreen(): void {
    const isLeaving = this.#isFullscreen;
    const change = isLeaving ? document.exitFullscreen() : this.host.requestFullscreen();
    void change.catch(() => {});
  }

  get #visibleButtons(): HTMLButtonElement[] {
    return Object.values(this.#buttons).filter((button) => !button.hidden);
  }

  #setMenuOpen(isOpen: boolean): void {
    this.menu.hidden = !isOpen;
    updateAttribute(this.#buttons.light, 'aria-expanded', String(isOpen));
    if (isOpen) this.menu.querySelector<HTMLInputElement>('input:checked')?.focus();
  }

  #updateMenu(items: readonly LightMenuItem[], texts: readonly string[]): void {
    if (String(texts) === this.#menuTexts) return;
    this.#menuTexts = String(texts);
    const labels = items.map((item, index) => {
      const input = createElement('input', { type: 'radio', name: 'light', value: item });
      return createElement('label', {}, input, createElement('span', {}, texts[index] ?? ''));
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
  const attributes = { part: 'button', type: 'button' };
  const button = createElement('button', attributes, createIcon(ICONS[iconName]));
  button.addEventListener('click', () => {
    if (button.getAttribute('aria-disabled') !== 'true') onPress();
  });
  return button;
}

function setLabel(button: HTMLButtonElement, label: string): void {
  updateAttribute(button, 'aria-label', label);
  updateAttribute(button, 'title', label);
}
