/** Shows the viewer's state in the shadow DOM and the toolbar, and announces changes, in the page's language. */

import { languageOf } from '../i18n/language.js';
import { formatNumber, type Language, type StringKey, t } from '../i18n/translations.js';
import { missingScript, type PhotoError } from '../shared/errors.js';
import { CENTRE } from '../shared/value-types.js';
import type { ViewerState } from '../state/viewer-state.js';
import type { ShadowDom } from './shadow-dom.js';
import type { Toolbar, ToolbarActions } from './toolbar.js';

export interface ToolbarCallbacks extends ToolbarActions {
  /** The toolbar has been loaded: call `update`. */
  loaded(): void;
  failed(error: PhotoError): void;
}

export class ViewerUi {
  /** `null` until it is needed. */
  toolbar: Toolbar | null = null;
  #toolbarFetch: Promise<void> | null = null;

  constructor(
    private readonly host: Element,
    private readonly dom: ShadowDom,
    private readonly state: ViewerState,
    private readonly listener: ToolbarCallbacks,
  ) {}

  get language(): Language {
    return languageOf(this.host);
  }

  /** `isTilting`: whether the torch follows the device's tilt; `null` if it cannot. */
  update(isPaused: boolean, isTilting: boolean | null): void {
    const { options, view, isPictureShown, reveal, light } = this.state;
    const { language } = this;
    const hasHandle = isPictureShown && light.isTorch;
    const zooms = isPictureShown && options.maxZoom > 1;
    const capturesTouch = zooms && !options.cooperativeGestures && (hasHandle || view.zoom > 1);
    const torch = light.torch ?? CENTRE;
    this.dom.requestSize(options.width, options.height);
    this.dom.updateFit();
    this.dom.updateLabels(this.host.getAttribute('alt'), language);
    const touchAction = capturesTouch ? 'none' : hasHandle || zooms ? 'pan-y' : 'auto';
    this.dom.updateLayout(hasHandle, zooms && !hasHandle, touchAction, language);
    this.dom.updateView(view, torch);
    this.dom.updatePoster(options, !isPictureShown, reveal.needsPress(options));
    const hasToolbar = options.controls && isPictureShown;
    if (hasToolbar) this.#toolbarFetch ??= this.#fetchToolbar();
    if (hasToolbar) this.toolbar?.update((key) => t(key, language), isPaused, isTilting);
    else this.toolbar?.hide();
  }

  /** `null` hides the message. */
  showError(details: string | null, isOffline: boolean): void {
    this.dom.retryButton.hidden = this.state.options.src === null;
    this.dom.showError(details, this.t(isOffline ? 'offline' : 'broken'));
  }

  announce(change: 'loaded' | 'light' | 'zoomed'): void {
    const { light, view } = this.state;
    const zoom = formatNumber(view.zoom, this.language, 'decimal');
    const text = this.t(change, zoom);
    this.dom.announce(change === 'light' ? `${text}: ${this.t(light.item)}` : text);
  }

  /** The toolbar is a separate script, fetched when the `controls` attribute is used for the first time. */
  async #fetchToolbar(): Promise<void> {
    try {
      const { Toolbar } = await import('./toolbar.js');
      const toolbar = new Toolbar(this.host, this.state, this.listener);
      this.toolbar = toolbar;
      this.dom.mountControls([toolbar.menu, toolbar.bar], toolbar.css);
      this.listener.loaded();
    } catch (cause) {
      this.listener.failed(missingScript('controls-unavailable', 'the controls', cause));
    }
  }

  /** A text in the element's language. */
  t(key: StringKey, ...values: readonly string[]): string {
    return t(key, this.language, ...values);
  }

  percent(value: number): string {
    return formatNumber(value, this.language, 'percent');
  }
}
