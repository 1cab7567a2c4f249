/** The page's texts in the visitor's language. English texts are those of the page and of texts/en.js. */

import english from './texts/en.js';

/** @typedef {Record<string, string>} Texts by key; `{name}` stands for a value */

/** The languages by their codes, with their own names. */
export const LANGUAGES = {
  en: 'English',
  fr: 'Français',
  de: 'Deutsch',
  it: 'Italiano',
  es: 'Español',
  ja: '日本語',
  zh: '中文',
};
/** @typedef {keyof typeof LANGUAGES} Language */

const STORED = 'relightable-photo-language';

/** @type {Texts} */
const pageTexts = {};
/** @type {Language} */
let language = 'en';
/** @type {Texts} */
let texts = english;
/** @type {Set<() => void>} */
const listeners = new Set();

/** Chooses the visitor's language, and shows the menu of languages. @param {HTMLElement} root */
export async function startLanguages(root) {
  for (const element of textElements(root)) {
    pageTexts[element.dataset['text'] ?? ''] = element.textContent ?? '';
  }
  const menu = /** @type {HTMLSelectElement} */ (document.getElementById('language'));
  menu.replaceChildren(...Object.entries(LANGUAGES).map(([code, name]) => new Option(name, code)));
  menu.parentElement?.removeAttribute('hidden');
  menu.addEventListener('change', () => {
    store(menu.value);
    void setLanguage(root, /** @type {Language} */ (menu.value));
  });
  const known = (/** @type {string | null} */ code) => code !== null && code in LANGUAGES;
  const wanted = [stored(), ...navigator.languages.map((code) => code.slice(0, 2))].find(known);
  menu.value = wanted ?? 'en';
  await setLanguage(root, /** @type {Language} */ (menu.value));
}

/** Calls `listener` after each change of the language. @param {() => void} listener */
export function onLanguageChange(listener) {
  listeners.add(listener);
}

/**
 * The text of a key.
 *
 * @param {string} key
 * @param {Record<string, string | number>} [values]
 */
export function t(key, values = {}) {
  const text = texts[key] ?? english[/** @type {keyof typeof english} */ (key)] ?? key;
  return text.replaceAll(/\{(\w+)\}/g, (_, name) => {
    const value = values[name];
    return typeof value === 'number' ? formatNumber(value) : (value ?? '');
  });
}

/** @param {number} value @param {number} [digits] after the decimal point */
export function formatNumber(value, digits = 0) {
  const options = { minimumFractionDigits: digits, maximumFractionDigits: digits };
  return new Intl.NumberFormat(language, options).format(value);
}

/** @param {HTMLElement} root @param {Language} code */
async function setLanguage(root, code) {
  const table = code === 'en' ? {} : (await import(`./texts/${code}.js`)).default;
  language = code;
  texts = { ...english, ...pageTexts, ...table };
  root.lang = code;
  for (const element of textElements(root)) {
    element.textContent = texts[element.dataset['text'] ?? ''] ?? '';
  }
  for (const listener of listeners) listener();
}

/** @param {HTMLElement} root @returns {NodeListOf<HTMLElement>} */
function textElements(root) {
  return root.querySelectorAll('[data-text]');
}

/** The language that the visitor chose before; pages may be denied storage. */
function stored() {
  try {
    return localStorage.getItem(STORED);
  } catch {
    return null;
  }
}

/** @param {string} code */
function store(code) {
  try {
    localStorage.setItem(STORED, code);
  } catch {
    // The choice holds for this visit.
  }
}
