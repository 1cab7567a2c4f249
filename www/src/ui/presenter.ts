/** Shows an exhibit, all of it but the picture itself, and tells of it in the language of the place. */

import { languageAt } from '../i18n/language.js';
import { isMissing, type Language, say, type Word } from '../i18n/strings.js';
import { mayTilt } from '../input/tilt-sensor.js';
import { CENTRE } from '../shared/values.js';
import type { LightItem } from '../state/lighting.js';
import type { Exhibit } from '../state/viewer-state.js';
import type { Controls } from './controls.js';
import { isFullscreen } from './fullscreen.js';
import { lightWords } from './light-labels.js';
import type { ToolbarState } from './toolbar.js';
import type { View } from './view.js';

/** See the module. */
export class Presenter {
  readonly #host: Element;
  readonly #view: View;
  readonly #controls: Controls;
  readonly #exhibit: Exhibit;

  constructor(host: Element, view: View, controls: Controls, exhibit: Exhibit) {
    this.#host = host;
    this.#view = view;
    this.#controls = controls;
    this.#exhibit = exhibit;
  }

  get language(): Language {
    return languageAt(this.#host);
  }

  present(paused: boolean, tilts: boolean): void {
    const { asked, view, shown, curtain, lighting } = this.#exhibit;
    const { language } = this;
    const light = shown && lighting.holdsTorch;
    const zooms = shown && asked.zoom > 1;
    const zoomed = view.zoom > 1;
    const at = lighting.torch ?? CENTRE;
    this.#view.describe(this.#host.getAttribute('alt'), language);
    const holds = zooms && !asked.cooperative && (light || zoomed);
    const touch = holds ? 'hold' : light || zooms ? 'scroll' : 'page';
    this.#view.arrange({ light, focusable: zooms && !light, zoomed, touch }, language);
    this.#view.place(view, at, lightWords(at, language));
    this.#view.poster(asked.poster, asked.crossOrigin, !shown, curtain.awaitsPress(asked));
    this.#controls.update(asked.controls && shown ? this.#buttons(paused, tilts) : null);
  }

  /** Shows what is wrong, if anything is. */
  fault(message: string | null): void {
    const fatal = this.#exhibit.fault !== null;
    this.#view.fault(message === null ? null : { fatal, message }, this.language);
  }

  /** Says how to zoom, where the page scrolled instead. */
  hint(by: 'wheel' | 'touch'): void {
    const key = /mac|iphone|ipad/i.test(navigator.platform) ? '⌘' : 'Ctrl';
    this.#view.hint(this.#say(by === 'wheel' ? 'wheelHint' : 'touchHint', key));
  }

  tellLoaded(): void {
    this.#view.tell(this.#say('loaded'));
  }

  tellZoom(): void {
    const { zoom } = this.#exhibit.view;
    const text = zoom.toLocaleString(this.language, { maximumFractionDigits: 1 });
    this.#view.tell(this.#say('zoomed', text));
  }

  tellLight(item: LightItem): void {
    this.#view.tell(`${this.#say('light')}: ${this.#say(item)}`);
  }

  #buttons(paused: boolean, tilts: boolean): ToolbarState {
    const { asked, view, lighting } = this.#exhibit;
    const { items, item, holdsTorch, canPlay } = lighting;
    return {
      // Another one once its words are there.
      language: `${this.language} ${isMissing(this.language)}`,
      say: (word) => this.#say(word),
      items,
      item,
      plays: canPlay || (holdsTorch && asked.breathes) ? !paused : null,
      zoom: asked.zoom > 1 ? { in: view.zoom < asked.zoom, out: view.zoom > 1 } : null,
      tilts: holdsTorch && mayTilt() ? tilts : null,
      fullscreen: document.fullscreenEnabled ? isFullscreen(this.#host) : null,
    };
  }

  #say(word: Word, ...values: readonly string[]): string {
    return say(word, this.language, ...values);
  }
}
