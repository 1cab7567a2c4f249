import assert from 'node:assert/strict';
import test from 'node:test';
import { AttributeReader } from './attribute-reader.js';

test('an invalid attribute keeps its last value, is reported once, and affects no other', () => {
  const attributes: Record<string, string | null> = {};
  const reader = new AttributeReader({
    baseURI: 'https://a.org/',
    getAttribute: (name) => attributes[name] ?? null,
  });
  const read = (light: string | null, exposure: string | null) => {
    Object.assign(attributes, { light, exposure });
    return [reader.read('light'), reader.read('exposure')];
  };
  const reported = () => reader.takeErrors().map(({ message }) => /“(.*?)”/.exec(message)?.[1]);
  assert.deepEqual(read('moon', '2'), ['flood', 2]);
  assert.deepEqual(reported(), ['moon']);
  assert.deepEqual(read('moon', 'much'), ['flood', 2]);
  assert.deepEqual(reported(), ['much']);
  assert.match(reader.errorOf('light')?.message ?? '', /moon/);
  assert.deepEqual(read('stripes', 'much'), ['stripes', 2]);
  assert.deepEqual(reported(), []);
  assert.equal(reader.errorOf('light'), null);
  assert.deepEqual(read('sun', '3'), ['stripes', 3]);
  assert.deepEqual(reported(), ['sun']);
  assert.ok(reader.errorOf('light') && !reader.errorOf('exposure'));
  assert.deepEqual(read(null, null), ['flood', 1]);
  assert.equal(reader.errorOf('light'), null);
  read('sun', null);
  reader.clear();
  assert.deepEqual([reader.errorOf('light'), reported()], [null, []]);
});

test('an unchanged attribute gives the same object, and an address follows its base', () => {
  const source = { baseURI: 'https://a.org/', getAttribute: () => 'a b' };
  const reader = new AttributeReader(source);
  const split = (text: string | null) => text?.split(' ');
  assert.equal(reader.parse('list', split), reader.parse('list', split));
  assert.equal(reader.readAddress('src'), 'https://a.org/a%20b');
  source.baseURI = 'https://b.org/';
  assert.equal(reader.readAddress('src'), 'https://b.org/a%20b');
});
