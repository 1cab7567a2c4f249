import assert from 'node:assert/strict';
import test from 'node:test';
import { multiplyRgb, parseLightColor } from './light-color.js';

const COLORS: Record<string, readonly number[]> = {
  white: [255, 255, 255, 255],
  orange: [255, 165, 0, 255],
  '#ff000080': [255, 0, 0, 128],
};
const read = (css: string) => COLORS[css] ?? null;

test('a colour is decoded from sRGB', () => {
  assert.equal(parseLightColor(null, read), null);
  assert.equal(parseLightColor(' ', read), null);
  assert.deepEqual(parseLightColor('white', read), { factors: [1, 1, 1], hex: '#ffffff' });
  const orange = parseLightColor(' orange ', read);
  assert.equal(orange?.hex, '#ffa500');
  // Hand-computed: ((165/255 + 0.055) / 1.055) ** 2.4.
  assert.ok(Math.abs((orange?.factors[1] ?? 0) - 0.3763) < 1e-4);
  assert.throws(() => parseLightColor('sunny', read), { code: 'attribute', message: /“sunny”/ });
});

test('alpha scales the brightness', () => {
  const half = parseLightColor('#ff000080', read);
  assert.equal(half?.hex, '#ff000080');
  assert.ok(Math.abs((half?.factors[0] ?? 0) - 128 / 255) < 1e-9);
});

test('factors multiply channel by channel', () => {
  assert.deepEqual(multiplyRgb([2, 1, 0.5], [0.5, 0.5, 0]), [1, 0.5, 0]);
});
