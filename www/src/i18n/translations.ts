/**
 * The texts that visitors see or hear. English is built in, and shown until the script of another language arrives. A
 * page may add languages, and replace single texts.
 */

import { ENGLISH, type StringKey, type Strings } from './en.js';

export type { StringKey } from './en.js';

/** Texts of a page; absent ones are those of the language's own script, or English. */
export type Translation = Partial<Strings>;

/** A BCP 47 tag in canonical case. */
export type Language = string;

/** Written out, because bundlers need literal addresses. */
const FETCHERS: Readonly<Record<Language, () => Promise<{ default: Strings }>>> = {
  en: async () => ({ default: ENGLISH }),
  fr: () => import('./fr.js'),
  de: () => import('./de.js'),
  it: () => import('./it.js'),
  es: () => import('./es.js'),
  ja: () => import('./ja.js'),
  zh: () => import('./zh.js'),
  'zh-Hant': () => import('./zh-hant.js'),
};

/** The languages with a script. */
export const LANGUAGES = Object.keys(FETCHERS);

const fetched = new Map<Language, Strings>([['en', ENGLISH]]);
const fetches = new Map<Language, Promise<void>>();
const added = new Map<Language, Translation>();
const listeners = new Set<() => void>();
const formats = new Map<string, Intl.NumberFormat>();

export function isSupported(language: Language): boolean {
  return LANGUAGES.includes(language) || added.has(language);
}

/** Whether the texts of a language are yet to be fetched. */
export function isPending(language: Language): boolean {
  return LANGUAGES.includes(language) && !fetched.has(language);
}

/** Fetches the texts of a language once per page. A failed fetch leaves English. */
export function fetchStrings(language: Language): Promise<void> {
  const fetch = FETCHERS[language] ?? FETCHERS['en'];
  const fetching =
    fetches.get(language) ??
    fetch?.()
      .catch(() => ({ default: ENGLISH }))
      .then((script) => void fetched.set(language, script.default));
  if (!fetching) return Promise.resolve();
  fetches.set(language, fetching);
  return fetching;
}

/** @throws {TypeError} for an invalid tag, an unknown key or a value that is no text */
export function addTranslation(lang: string, strings: Translation): void {
  const language = canonicalTag(lang);
  if (!language) throw new TypeError(`“${lang}” is not a language tag such as pt or pt-BR`);
  for (const [key, text] of Object.entries(strings)) {
    if (!Object.hasOwn(ENGLISH, key)) throw new TypeError(`there is no text named “${key}”`);
    if (typeof text !== 'string') throw new TypeError(`the text ${key} must be a string`);
  }
  added.set(language, { ...added.get(language), ...strings });
  for (const changed of listeners) changed();
}

/** Calls back whenever a page adds texts, until `signal` is aborted. */
export function observeTranslations(changed: () => void, signal: AbortSignal): void {
  listeners.add(changed);
  signal.addEventListener('abort', () => listeners.delete(changed));
}

/** A text in a language, with `values` in place of its placeholders. */
export function t(key: StringKey, language: Language, ...values: readonly string[]): string {
  const text = added.get(language)?.[key] ?? fetched.get(language)?.[key] ?? ENGLISH[key];
  return text.replace(/\{(\d)\}/g, (_, index: string) => values[Number(index)] ?? '');
}

/** A number in a language, as a percentage or with at most one decimal. */
export function formatNumber(
  value: number,
  language: Language,
  style: 'percent' | 'decimal',
): string {
  const key = `${language} ${style}`;
  const maximumFractionDigits = style === 'percent' ? 0 : 1;
  const format =
    formats.get(key) ?? new Intl.NumberFormat(language, { style, maximumFractionDigits });
  formats.set(key, format);
  return format.format(value);
}

/** `null` if the tag is invalid. Also accepts an underscore, which some content systems write. */
export function canonicalTag(tag: string): Language | null {
  try {
    return new Intl.Locale(tag.trim().replaceAll('_', '-')).baseName;
  } catch {
    return null;
  }
}
