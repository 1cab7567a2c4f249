import assert from 'node:assert/strict';
import test from 'node:test';
import { clampToPicture } from './value-types.js';

test('points are clamped to the picture and rounded to a ten-thousandth', () => {
  assert.deepEqual(clampToPicture({ x: -1, y: 2 }), { x: 0, y: 1 });
  assert.deepEqual(clampToPicture({ x: 1 / 3, y: 0.25 }), { x: 0.3333, y: 0.25 });
});
