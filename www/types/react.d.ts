/** `<relightable-photo>` in React's JSX, from version 19 on. */

import type { DetailedHTMLProps, HTMLAttributes } from 'react';
import type { RelightablePhotoElement } from './element/element.js';
import type { RelightablePhotoAttributes } from './jsx-attributes.js';

/** What the element takes in JSX: its attributes by their names in HTML, and handlers such as `onlightchange`. */
export type RelightablePhotoProps = Omit<
  DetailedHTMLProps<HTMLAttributes<RelightablePhotoElement>, RelightablePhotoElement>,
  keyof RelightablePhotoAttributes
> &
  RelightablePhotoAttributes;

declare module 'react' {
  namespace JSX {
    interface IntrinsicElements {
      'relightable-photo': RelightablePhotoProps;
    }
  }
}
