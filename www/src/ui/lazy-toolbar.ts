/** The toolbar's placeholder: fetches its script when the `controls` attribute is used for the first time. */

import { missingScript, type PhotoError } from '../shared/errors.js';
import type { ShadowDom } from './shadow-dom.js';
import type { Toolbar, ToolbarActions, ToolbarState } from './toolbar.js';

export interface LazyToolbarListener {
  /** The toolbar is mounted: call `update`. */
  loaded(): void;
  failed(error: PhotoError): void;
}

export class LazyToolbar {
  readonly #dom: ShadowDom;
  readonly #actions: ToolbarActions;
  readonly #listener: LazyToolbarListener;
  #toolbar: Toolbar | null = null;
  #isRequested = false;

  constructor(dom: ShadowDom, actions: ToolbarActions, listener: LazyToolbarListener) {
    this.#dom = dom;
    this.#actions = actions;
    this.#listener = listener;
  }

  /** `null` hides the toolbar. */
  update(state: ToolbarState | null): void {
    const toolbar = this.#toolbar;
    if (toolbar) toolbar.bar.hidden = state === null;
    if (!state) toolbar?.closeMenu();
    else if (toolbar) toolbar.update(state);
    else if (!this.#isRequested) void this.#fetch();
  }

  closeMenu(): void {
    this.#toolbar?.closeMenu();
  }

  /** Shows the toolbar after an input: for good after a key press, otherwise for some seconds. */
  show(byKeyboard: boolean): void {
    this.#toolbar?.show(byKeyboard);
  }

  async #fetch(): Promise<void> {
    this.#isRequested = true;
    try {
      const { Toolbar } = await import('./toolbar.js');
      const toolbar = new Toolbar(this.#actions);
      this.#toolbar = toolbar;
      this.#dom.mountControls([toolbar.menu, toolbar.bar], toolbar.css);
      this.#listener.loaded();
    } catch (cause) {
      this.#listener.failed(missingScript('controls-unavailable', 'the controls', cause));
    }
  }
}
