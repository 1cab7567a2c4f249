import assert from 'node:assert/strict';
import test from 'node:test';
import { reuse } from './reuse-if-equal.js';

test('equal settings stay the same object', () => {
  const point = { x: 1, y: 2 };
  const before = { name: 'torch', point };
  assert.equal(reuse(before, { name: 'torch', point }), before);
  assert.equal(reuse(point, { x: 1, y: 2 }), point);
});

test('a changed, added or removed field makes a new object', () => {
  const before: { a: number; b?: number } = { a: 1 };
  for (const next of [{ a: 2 }, { a: 1, b: 2 }, { b: 1 } as unknown as { a: number }]) {
    assert.equal(reuse(before, next), next);
  }
  const nested = { point: { x: 1 } };
  const next = { point: { x: 1 } };
  assert.equal(reuse(nested, next), next, 'fields are compared by reference');
  assert.equal(reuse(null, next), next);
});
