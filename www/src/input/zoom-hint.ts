/** The hint that explains how to zoom, after the page scrolled instead. */

import { createElement, updateText } from '../ui/dom-helpers.js';
import type { ViewerUi } from '../ui/viewer-ui.js';

const HINT_MS = 1800;

export class ZoomHint {
  readonly element = createElement('div', { class: 'hint panel', part: 'hint', hidden: '' });
  #timer: ReturnType<typeof setTimeout> | undefined;

  show(by: 'wheel' | 'touch', texts: Pick<ViewerUi, 'language' | 't'>): void {
    const key = /mac|iphone|ipad/i.test(navigator.platform) ? '⌘' : 'Ctrl';
    const { element } = this;
    element.lang = texts.language;
    updateText(element, texts.t(by === 'wheel' ? 'wheelHint' : 'touchHint', key));
    element.hidden = false;
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => {
      element.hidden = true;
    }, HINT_MS);
  }
}
