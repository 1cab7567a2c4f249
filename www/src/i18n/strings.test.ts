import assert from 'node:assert/strict';
import test from 'node:test';
import { lightWords } from '../ui/light-labels.js';
import { ENGLISH, fetchTranslations, isMissing, LANGUAGES, languageOf, say } from './strings.js';
import { TRANSLATIONS } from './translations.js';

/** Words that are the same in English, as they should be. */
const ENGLISH_TOO = new Set([
  'de zoomed',
  'es zoomed',
  'fr zoomed',
  'it zoomed',
  'fr pause',
  'fr projection',
]);

await fetchTranslations();

const words = Object.entries(ENGLISH).map(
  ([word, english]) => [word, [english, ...TRANSLATIONS[word as keyof typeof ENGLISH]]] as const,
);

test('every text is there in every language, translated, with the same places to fill in', () => {
  for (const [word, texts] of words) {
    assert.equal(texts.length, LANGUAGES.length, word);
    const [english = ''] = texts;
    const places = (text: string) => (text.match(/\{\d\}/g) ?? []).sort();
    for (const [index, language] of LANGUAGES.entries()) {
      const text = texts[index] ?? '';
      const what = `${language} ${word}`;
      assert.equal(text, text.trim(), what);
      assert.notEqual(text, '', what);
      assert.deepEqual(places(text), places(english), what);
      const same = language !== 'en' && text === english;
      assert.equal(same, ENGLISH_TOO.has(what), `${what}: ${text}`);
    }
  }
});

test('the language is the first that there are texts in', () => {
  assert.equal(languageOf(['de-CH']), 'de');
  assert.equal(languageOf(['pt', 'FR_ca']), 'fr');
  assert.equal(languageOf(['', 'zh-Hant-TW']), 'zh');
  assert.equal(languageOf([]), 'en');
});

test('texts are filled in', () => {
  assert.equal(isMissing('fr'), false);
  assert.equal(say('zoomed', 'en', '2.5'), 'Zoom 2.5×');
  assert.equal(say('wheelHint', 'de', 'Ctrl'), 'Zoomen mit Ctrl + Scrollen');
});

test('a light is told by where it is, and how far from the middle', () => {
  const at = (x: number, y: number) => lightWords({ x, y }, 'en');
  assert.equal(at(0.3, 0.35), 'Light from upper left, near, 30 % · 35 %');
  assert.equal(at(0.1, 0.1), 'Light from upper left, far, 10 % · 10 %');
  assert.equal(at(0.5, 0.9), 'Light from below, far, 50 % · 90 %');
  assert.equal(at(0.52, 0.5), 'Light in the middle, 52 % · 50 %');
  assert.equal(lightWords({ x: 0.9, y: 0.5 }, 'ja'), '光：右、遠い、90 % · 50 %');
  const all = new Set<string>();
  for (const x of [0, 0.5, 1]) for (const y of [0, 0.5, 1]) all.add(at(x, y));
  assert.equal(all.size, 9);
});
