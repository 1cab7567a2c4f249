/** When a photograph is fetched, and when its poster gives way to it. */

import type { Loading, Reveal } from './attribute-values.js';

/** What a page asks of it. */
export interface CurtainAsked {
  readonly loading: Loading;
  readonly reveal: Reveal;
}

/** See the module. */
export class Curtain {
  /** Whether the element is within a screen of the visitor's, and whether it can be seen. */
  near = false;
  seen = false;
  /** Whether there is a picture. */
  drawn = false;
  /** Somebody pressed the poster, or a script let it go. */
  lifted = false;

  mayFetch({ loading, reveal }: CurtainAsked): boolean {
    if (loading === 'eager') return true;
    if (reveal === 'interaction' && !this.lifted) return false;
    return loading === 'lazy' ? this.seen : this.near;
  }

  /** Whether the picture is hidden. */
  isDown({ reveal }: CurtainAsked): boolean {
    return !this.drawn || (reveal !== 'auto' && !this.lifted);
  }

  /** Whether somebody has to press the poster. */
  awaitsPress({ reveal }: CurtainAsked): boolean {
    return reveal === 'interaction' && !this.lifted;
  }
}
