/** Chooses the language of an element. */

import { canonicalTag, isSupported, type Language } from './translations.js';

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
    const found = candidates(tag).find(isSupported);
    if (found) return found;
  }
  return 'en';
}

/** From the tag to its language alone. Between them is the script that its region uses: `zh-Hant` for `zh-TW`. */
function candidates(tag: string): readonly string[] {
  const exact = canonicalTag(tag);
  if (!exact) return [];
  const { language, script } = new Intl.Locale(exact).maximize();
  return [exact, exact.split('-', 2).join('-'), `${language}-${script}`, language];
}
