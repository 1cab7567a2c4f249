/** The language of a place in a page. */

import { type Language, languageOf } from './strings.js';

/** By the nearest `lang`, also beyond the shadow roots it is in; then by the browser's own. */
export function languageAt(element: Element): Language {
  const tags = [navigator.language];
  let at: Element | null = element;
  while (at) {
    const named: Element | null = at.closest('[lang]');
    if (named) {
      tags.unshift(named.getAttribute('lang') ?? '');
      break;
    }
    const root = at.getRootNode();
    at = root instanceof ShadowRoot ? root.host : null;
  }
  return languageOf(tags);
}
