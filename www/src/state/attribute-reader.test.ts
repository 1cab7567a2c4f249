import assert from 'node:assert/strict';
import test from 'node:test';
import { parseExposure, parseLight } from '../shared/parse-settings.js';
import { Attributes } from './attribute-reader.js';

test('what is wrong leaves what was right, is told once, and takes nothing else along', () => {
  const it = new Attributes();
  const read = (light: string | null, exposure: string | null) => [
    it.read('light', light, parseLight),
    it.read('exposure', exposure, parseExposure),
  ];
  const told = () => it.takeFaults().map(({ message }) => /“(.*?)”/.exec(message)?.[1]);
  assert.deepEqual(read('moon', '2'), ['flood', 2]);
  assert.deepEqual(told(), ['moon']);
  assert.deepEqual(read('moon', 'much'), ['flood', 2]);
  assert.deepEqual(told(), ['much']);
  assert.match(it.message ?? '', /moon/);
  assert.deepEqual(read('stripes', 'much'), ['stripes', 2]);
  assert.deepEqual(told(), []);
  assert.match(it.message ?? '', /much/);
  assert.deepEqual(read('sun', '3'), ['stripes', 3]);
  assert.deepEqual(told(), ['sun']);
  assert.ok(it.isWrong('light') && !it.isWrong('exposure'));
  assert.deepEqual(read(null, null), ['flood', 1]);
  assert.equal(it.message, null);
  it.read('light', 'sun', parseLight);
  it.clear();
  assert.deepEqual([it.message, told()], [null, []]);
});
