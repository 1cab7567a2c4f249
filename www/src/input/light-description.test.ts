import assert from 'node:assert/strict';
import test from 'node:test';
import { fetchStrings, formatNumber, type StringKey, t } from '../i18n/translations.js';
import { describeLight } from './light-description.js';

await fetchStrings('ja');

const textsIn = (language: string) => ({
  t: (key: StringKey, ...values: readonly string[]) => t(key, language, ...values),
  percent: (value: number) => formatNumber(value, language, 'percent'),
});

test('the light is described by its direction and its distance from the middle', () => {
  const at = (x: number, y: number) => describeLight({ x, y }, textsIn('en'));
  assert.equal(at(0.3, 0.35), 'Light from upper left, near, 30% · 35%');
  assert.equal(at(0.1, 0.1), 'Light from upper left, far, 10% · 10%');
  assert.equal(at(0.5, 0.9), 'Light from below, far, 50% · 90%');
  assert.equal(at(0.52, 0.5), 'Light in the middle, 52% · 50%');
  assert.equal(describeLight({ x: 0.9, y: 0.5 }, textsIn('ja')), '光：右、遠い、90% · 50%');
  const all = new Set<string>();
  for (const x of [0, 0.5, 1]) for (const y of [0, 0.5, 1]) all.add(at(x, y));
  assert.equal(all.size, 9);
});
