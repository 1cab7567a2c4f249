/** Makes `<relightable-photo>` known to the page. */

import { RelightablePhoto } from './element.js';

/** The element's name in HTML. */
export const TAG = 'relightable-photo';

/** Defines the element, where there are elements, unless it is defined: a page may come to load two copies. */
export function defineRelightablePhoto(): void {
  if (globalThis.customElements && !customElements.get(TAG)) {
    customElements.define(TAG, RelightablePhoto);
  }
}
