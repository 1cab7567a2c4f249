/** Registers `<relightable-photo>` with the page. */

import { RelightablePhotoElement } from './element.js';

/** The element's name in HTML. */
export const TAG = 'relightable-photo';

/** Defines the element once, even if a page loads two copies of this script. Does nothing on a server. */
export function defineRelightablePhoto(): void {
  if (globalThis.customElements && !customElements.get(TAG)) {
    customElements.define(TAG, RelightablePhotoElement);
  }
}
