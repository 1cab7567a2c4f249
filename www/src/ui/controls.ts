/** The place of the buttons: they are fetched by the first page that asks for them, as most do without. */

import { PhotoError } from '../shared/errors.js';
import type { Toolbar, ToolbarActions, ToolbarState } from './toolbar.js';
import type { View } from './view.js';

/** See the module. */
export class Controls {
  readonly #view: View;
  readonly #actions: ToolbarActions;
  readonly #come: () => void;
  readonly #failed: (error: PhotoError) => void;
  #toolbar: Toolbar | null = null;
  #fetching = false;

  /** `come` is told when the buttons are there, and want to be updated. */
  constructor(
    view: View,
    actions: ToolbarActions,
    come: () => void,
    failed: (error: PhotoError) => void,
  ) {
    this.#view = view;
    this.#actions = actions;
    this.#come = come;
    this.#failed = failed;
  }

  /** `null` hides them. */
  update(state: ToolbarState | null): void {
    const toolbar = this.#toolbar;
    if (toolbar) toolbar.bar.hidden = state === null;
    if (!state) toolbar?.close();
    else if (toolbar) toolbar.update(state);
    else if (!this.#fetching) void this.#fetch();
  }

  close(): void {
    this.#toolbar?.close();
  }

  /** Somebody moves a pointer over the picture, or uses keys. */
  wake(byKey: boolean): void {
    if (byKey) this.#toolbar?.stay();
    else this.#toolbar?.wake();
  }

  async #fetch(): Promise<void> {
    this.#fetching = true;
    try {
      const { Toolbar } = await import('./toolbar.js');
      const toolbar = new Toolbar(this.#actions);
      this.#toolbar = toolbar;
      this.#view.furnish([toolbar.menu, toolbar.bar], toolbar.style);
      this.#come();
    } catch (cause) {
      const message =
        "The controls could not be loaded. Their script has to lie beside the element's.";
      this.#failed(new PhotoError('controls-unavailable', message, cause));
    }
  }
}
