/** `<relightable-photo>` in the JSX of what looks for elements in the global namespace, as React 18 does. */

import type { RelightablePhotoElement } from './element/element.js';
import type { RelightablePhotoAttributes } from './jsx-attributes.js';

/** What the element takes in JSX; keys, references and attributes of every element are not checked. */
export interface RelightablePhotoProps extends RelightablePhotoAttributes {
  readonly ref?: RelightablePhotoRef | undefined;
  readonly [attribute: string]: unknown;
}

type RelightablePhotoRef =
  | ((element: RelightablePhotoElement | null) => unknown)
  | { current: RelightablePhotoElement | null }
  | string
  | null;

declare global {
  namespace JSX {
    interface IntrinsicElements {
      'relightable-photo': RelightablePhotoProps;
    }
  }
}
