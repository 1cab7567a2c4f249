/** The texts that visitors see or hear. English is built in, and shown until the script of another language arrives. */

import { ENGLISH, type StringKey, type Strings } from './en.js';

export type { StringKey } from './en.js';

/** Written out, because bundlers need literal addresses. */
const FETCHERS = {
  en: async () => ({ default: ENGLISH }),
  fr: () => import('./fr.js'),
  de: () => import('./de.js'),
  it: () => import('./it.js'),
  es: () => import('./es.js'),
  ja: () => import('./ja.js'),
  zh: () => import('./zh.js'),
} as const;

export type Language = keyof typeof FETCHERS;

export const LANGUAGES = Object.keys(FETCHERS) as Language[];

const strings: Partial<Record<Language, Strings>> = { en: ENGLISH };
const fetches: Partial<Record<Language, Promise<void>>> = {};

/** Whether the texts of a language are yet to be fetched. */
export function isPending(language: Language): boolean {
  return !strings[language];
}

/** Fetches the texts of a language once per page. A failed fetch leaves English. */
export function fetchStrings(language: Language): Promise<void> {
  fetches[language] ??= FETCHERS[language]()
    .catch(FETCHERS.en)
    .then((script) => {
      strings[language] = script.default;
    });
  return fetches[language];
}

/** A text in a language, with `values` in place of its placeholders. */
export function t(key: StringKey, language: Language, ...values: readonly string[]): string {
  const text = (strings[language] ?? ENGLISH)[key];
  return text.replace(/\{(\d)\}/g, (_, index: string) => values[Number(index)] ?? '');
}
