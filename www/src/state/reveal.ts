/** When a photograph is fetched, and when its poster gives way to the picture. */

import type { ElementOptions } from './options.js';

type RevealOptions = Pick<ElementOptions, 'loading' | 'reveal'>;

export class RevealState {
  /** Within one screen of the viewport. */
  isNear = false;
  /** In the viewport. */
  isVisible = false;
  /** A picture of the photograph has been drawn. */
  isDrawn = false;
  /** A visitor pressed the poster, or a script called `dismissPoster()`. */
  isDismissed = false;

  mayFetch(options: RevealOptions): boolean {
    return !this.needsPress(options) && (options.loading === 'eager' || this.isNear);
  }

  isPosterShown({ reveal }: RevealOptions): boolean {
    return !this.isDrawn || (reveal !== 'auto' && !this.isDismissed);
  }

  /** Whether the poster waits for a press. */
  needsPress({ reveal }: RevealOptions): boolean {
    return reveal === 'interaction' && !this.isDismissed;
  }
}
