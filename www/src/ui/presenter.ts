/** Shows the viewer's state in the shadow DOM and the toolbar, and announces changes, in the page's language. */

import { languageOf } from '../i18n/language.js';
import { isPending, type Language, type StringKey, t } from '../i18n/strings.js';
import { missingScript, type PhotoError } from '../shared/errors.js';
import { CENTRE } from '../shared/values.js';
import type { LightItem } from '../state/light-state.js';
import type { ViewerState } from '../state/viewer-state.js';
import { describeLight } from './light-description.js';
import type { ShadowDom } from './shadow-dom.js';
import type { Toolbar, ToolbarActions, ToolbarState } from './toolbar.js';

export interface PresenterListener {
  /** The toolbar has been loaded: call `update`. */
  toolbarLoaded(): void;
  failed(error: PhotoError): void;
}

export class Presenter {
  readonly #host: Element;
  readonly #dom: ShadowDom;
  readonly #state: ViewerState;
  readonly #actions: ToolbarActions;
  readonly #listener: PresenterListener;
  #toolbar: Toolbar | null = null;
  #isToolbarRequested = false;

  constructor(
    host: Element,
    dom: ShadowDom,
    state: ViewerState,
    actions: ToolbarActions,
    listener: PresenterListener,
  ) {
    this.#host = host;
    this.#dom = dom;
    this.#state = state;
    this.#actions = actions;
    this.#listener = listener;
  }

  get language(): Language {
    return languageOf(this.#host);
  }

  /** `isTilting`: whether the torch follows the device's tilt; `null` if it cannot. */
  update(isPaused: boolean, isTilting: boolean | null): void {
    const { options, view, isPictureShown, reveal, light } = this.#state;
    const { language } = this;
    const hasHandle = isPictureShown && light.isTorch;
    const zooms = isPictureShown && options.maxZoom > 1;
    const isZoomed = view.zoom > 1;
    const capturesTouch = zooms && !options.cooperativeGestures && (hasHandle || isZoomed);
    const torch = light.torch ?? CENTRE;
    this.#dom.updateLabels(this.#host.getAttribute('alt'), language);
    this.#dom.updateLayout(
      {
        hasHandle,
        isFocusable: zooms && !hasHandle,
        isZoomed,
        touchAction: capturesTouch ? 'none' : hasHandle || zooms ? 'pan-y' : 'auto',
      },
      language,
    );
    this.#dom.updateView(view, torch, describeLight(torch, language));
    this.#dom.updatePoster(
      options.poster,
      options.crossOrigin,
      !isPictureShown,
      reveal.needsPress(options),
    );
    const hasToolbar = options.controls && isPictureShown;
    if (hasToolbar && !this.#isToolbarRequested) void this.#fetchToolbar();
    this.#toolbar?.update(hasToolbar ? this.#toolbarState(isPaused, isTilting) : null);
  }

  /** Shows the toolbar after an input: for good after a key press, otherwise for some seconds. */
  showToolbar(byKeyboard: boolean): void {
    this.#toolbar?.show(byKeyboard);
  }

  closeMenu(): void {
    this.#toolbar?.closeMenu();
  }

  get #isFullscreen(): boolean {
    return this.#host.matches(':fullscreen');
  }

  /** Does nothing where the browser, an enclosing frame or the visitor refuses. */
  toggleFullscreen(): void {
    const isLeaving = this.#isFullscreen;
    const change = isLeaving ? document.exitFullscreen() : this.#host.requestFullscreen();
    void change.catch(() => {});
  }

  /** Returns whether the element was in full screen. */
  leaveFullscreen(): boolean {
    const wasFullscreen = this.#isFullscreen;
    if (wasFullscreen) this.toggleFullscreen();
    return wasFullscreen;
  }

  /** `null` hides the message. */
  showError(details: string | null): void {
    const summary = this.#state.errorMessage === null ? 'degraded' : 'broken';
    this.#dom.showError(details, this.#t(summary));
  }

  /** Explains how to zoom, after the page scrolled instead. */
  hintAtZoom(by: 'wheel' | 'touch'): void {
    const key = /mac|iphone|ipad/i.test(navigator.platform) ? '⌘' : 'Ctrl';
    this.#dom.showHint(this.#t(by === 'wheel' ? 'wheelHint' : 'touchHint', key));
  }

  announceLoaded(): void {
    this.#dom.announce(this.#t('loaded'));
  }

  announceZoom(): void {
    const { zoom } = this.#state.view;
    const text = zoom.toLocaleString(this.language, { maximumFractionDigits: 1 });
    this.#dom.announce(this.#t('zoomed', text));
  }

  announceLight(item: LightItem): void {
    this.#dom.announce(`${this.#t('light')}: ${this.#t(item)}`);
  }

  /** The toolbar is a separate script, fetched when the `controls` attribute is used for the first time. */
  async #fetchToolbar(): Promise<void> {
    this.#isToolbarRequested = true;
    try {
      const { Toolbar } = await import('./toolbar.js');
      const toolbar = new Toolbar(this.#actions);
      this.#toolbar = toolbar;
      this.#dom.mountControls([toolbar.menu, toolbar.bar], toolbar.css);
      this.#listener.toolbarLoaded();
    } catch (cause) {
      this.#listener.failed(missingScript('controls-unavailable', 'the controls', cause));
    }
  }

  #toolbarState(isPaused: boolean, isTilting: boolean | null): ToolbarState {
    const { options, view, light } = this.#state;
    const isPlayable = light.isPlayable || (light.isTorch && options.autoplayLight);
    return {
      t: (key) => this.#t(key),
      languageKey: `${this.language} ${isPending(this.language)}`,
      items: light.items,
      item: light.item,
      isPlaying: isPlayable ? !isPaused : null,
      zoom:
        options.maxZoom > 1
          ? { canZoomIn: view.zoom < options.maxZoom, canZoomOut: view.zoom > 1 }
          : null,
      isTilting,
      isFullscreen: document.fullscreenEnabled ? this.#isFullscreen : null,
    };
  }

  #t(key: StringKey, ...values: readonly string[]): string {
    return t(key, this.language, ...values);
  }
}
