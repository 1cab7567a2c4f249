/** Chooses the language of an element. */

import { LANGUAGES, type Language } from './strings.js';

/** By the nearest `lang` attribute, also outside of shadow roots, and otherwise by the browser's language. */
export function languageOf(element: Element): Language {
  const tags = [navigator.language];
  let current: Element | null = element;
  while (current) {
    const labelled: Element | null = current.closest('[lang]');
    if (labelled) {
      tags.unshift(labelled.getAttribute('lang') ?? '');
      break;
    }
    const root = current.getRootNode();
    current = root instanceof ShadowRoot ? root.host : null;
  }
  return firstSupported(tags);
}

/** The first supported language of some BCP 47 tags; English if there is none. */
export function firstSupported(tags: readonly string[]): Language {
  for (const tag of tags) {
    const primary = tag.trim().toLowerCase().split(/[-_]/, 1)[0];
    const language = LANGUAGES.find((known) => known === primary);
    if (language) return language;
  }
  return 'en';
}
