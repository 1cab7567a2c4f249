/** Chooses the language of an element. */

import { LANGUAGES, type Language } from './translations.js';

/** By the nearest `lang` attribute, also outside of shadow roots, and otherwise by the browser's language. */
export function languageOf(element: Element): Language {
  return firstSupported([tagOf(element), navigator.language]);
}

function tagOf(element: Element): string {
  const labelled = element.closest('[lang]');
  if (labelled) return labelled.getAttribute('lang') ?? '';
  const root = element.getRootNode();
  return root instanceof ShadowRoot ? tagOf(root.host) : '';
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
