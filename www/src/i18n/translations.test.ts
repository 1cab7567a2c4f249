import assert from 'node:assert/strict';
import test from 'node:test';
import { ENGLISH, type StringKey } from './en.js';
import { firstSupported } from './language.js';
import {
  addTranslation,
  fetchStrings,
  formatNumber,
  isPending,
  LANGUAGES,
  type Language,
  observeTranslations,
  t,
} from './translations.js';

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
  assert.equal(firstSupported(['', 'zh-Hant-TW']), 'zh-Hant');
  assert.equal(firstSupported(['not a tag', 'ZH-tw']), 'zh-Hant');
  assert.equal(firstSupported(['zh-HK']), 'zh-Hant');
  for (const tag of ['zh', 'zh-CN', 'zh-Hans-HK', 'zh-SG']) {
    assert.equal(firstSupported([tag]), 'zh', tag);
  }
  assert.equal(firstSupported([]), 'en');
});

test('numbers are written as the language does', () => {
  assert.equal(formatNumber(0.349, 'en', 'percent'), '35%');
  assert.equal(formatNumber(0.349, 'de', 'percent'), '35\u00a0%');
  assert.equal(formatNumber(2.54, 'fr', 'decimal'), '2,5');
});

test('a page adds a language and replaces single texts', () => {
  let changes = 0;
  const observing = new AbortController();
  observeTranslations(() => {
    changes += 1;
  }, observing.signal);
  assert.equal(firstSupported(['pt-BR']), 'en');
  addTranslation('pt', { torch: 'Lanterna', zoomed: 'Zoom {0}×' });
  assert.equal(firstSupported(['pt-BR']), 'pt');
  assert.equal(isPending('pt'), false);
  assert.deepEqual([t('torch', 'pt'), t('fire', 'pt')], ['Lanterna', 'Fire']);
  addTranslation('PT', { fire: 'Fogo' });
  assert.deepEqual([t('torch', 'pt'), t('fire', 'pt')], ['Lanterna', 'Fogo']);
  addTranslation('fr', { reveal: 'Touchez la lumière' });
  assert.deepEqual([t('reveal', 'fr'), t('torch', 'fr')], ['Touchez la lumière', 'Torche']);
  assert.equal(changes, 3);
  observing.abort();
  addTranslation('pt-BR', { torch: 'Lanterna' });
  assert.equal(changes, 3);
  assert.equal(firstSupported(['pt-BR']), 'pt-BR');
  assert.throws(() => addTranslation('1', {}), /TypeError: “1” is not a language tag/);
  assert.throws(() => addTranslation('pt', { moon: 'Lua' } as never), /no text named “moon”/);
  assert.throws(() => addTranslation('pt', { fire: 1 } as never), /the text fire must be a string/);
});

test('placeholders are filled in', () => {
  assert.equal(isPending('fr'), false);
  assert.equal(t('zoomed', 'en', '2.5'), 'Zoom 2.5×');
  assert.equal(t('wheelHint', 'de', 'Ctrl'), 'Zoomen mit Ctrl + Scrollen');
});
