import assert from 'node:assert/strict';
import test from 'node:test';
import { ENGLISH, type StringKey } from './en.js';
import { firstSupported } from './language.js';
import { fetchStrings, isPending, LANGUAGES, type Language, t } from './translations.js';

/** Translations that are correctly the same as in English. */
const SAME_AS_ENGLISH = new Set([
  'de zoomed',
  'es zoomed',
  'fr zoomed',
  'it zoomed',
  'fr pause',
  'fr projection',
]);

for (const language of LANGUAGES) if (isPending(language)) await fetchStrings(language);

/** A text with its placeholders unchanged. */
const template = (key: StringKey, language: Language) => t(key, language, '{0}', '{1}', '{2}');

test('every text is translated into every language, with the same placeholders', () => {
  const placeholders = (text: string) => (text.match(/\{\d\}/g) ?? []).sort();
  for (const key of Object.keys(ENGLISH) as StringKey[]) {
    for (const language of LANGUAGES) {
      const text = template(key, language);
      const label = `${language} ${key}`;
      assert.equal(text, text.trim(), label);
      assert.notEqual(text, '', label);
      assert.deepEqual(placeholders(text), placeholders(ENGLISH[key]), label);
      const isEnglish = language !== 'en' && text === ENGLISH[key];
      assert.equal(isEnglish, SAME_AS_ENGLISH.has(label), `${label}: ${text}`);
    }
  }
});

test('the language is the first supported one', () => {
  assert.equal(firstSupported(['de-CH']), 'de');
  assert.equal(firstSupported(['pt', 'FR_ca']), 'fr');
  assert.equal(firstSupported(['', 'zh-Hant-TW']), 'zh');
  assert.equal(firstSupported([]), 'en');
});

test('placeholders are filled in', () => {
  assert.equal(isPending('fr'), false);
  assert.equal(t('zoomed', 'en', '2.5'), 'Zoom 2.5×');
  assert.equal(t('wheelHint', 'de', 'Ctrl'), 'Zoomen mit Ctrl + Scrollen');
});
