import assert from 'node:assert/strict';
import test from 'node:test';
import { parseColor, tinted } from './tint.js';

const COLORS: Record<string, readonly number[]> = {
  white: [255, 255, 255, 255],
  orange: [255, 165, 0, 255],
  '#ff000080': [255, 0, 0, 128],
};
const read = (css: string) => COLORS[css] ?? null;

test('a colour is its light, decoded from sRGB', () => {
  assert.equal(parseColor(null, read), null);
  assert.equal(parseColor(' ', read), null);
  assert.deepEqual(parseColor('white', read), { tint: [1, 1, 1], hex: '#ffffff' });
  const orange = parseColor(' orange ', read);
  assert.equal(orange?.hex, '#ffa500');
  // Hand-computed: ((165/255 + 0.055) / 1.055) ** 2.4.
  assert.ok(Math.abs((orange?.tint[1] ?? 0) - 0.3763) < 1e-4);
  assert.throws(() => parseColor('sunny', read), { code: 'attribute', message: /“sunny”/ });
});

test('what is transparent by half shines by half', () => {
  const half = parseColor('#ff000080', read);
  assert.equal(half?.hex, '#ff000080');
  assert.ok(Math.abs((half?.tint[0] ?? 0) - 128 / 255) < 1e-9);
});

test('a tint multiplies', () => {
  assert.deepEqual(tinted([2, 1, 0.5], [0.5, 0.5, 0]), [1, 0.5, 0]);
});
