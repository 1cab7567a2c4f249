import assert from 'node:assert/strict';
import test from 'node:test';
import {
  parseExposure,
  parseGamut,
  parseLight,
  parseTone,
  parseWhiteBalance,
} from './setting-parsers.js';

test('an empty value means the default', () => {
  assert.equal(parseLight(null), 'flood');
  assert.equal(parseExposure(null), 1);
  assert.deepEqual(parseWhiteBalance(null), [1, 1, 1]);
  assert.equal(parseTone(''), 'clip');
  assert.equal(parseGamut(null), 'srgb');
});

test('a white balance has three factors', () => {
  assert.deepEqual(parseWhiteBalance(' 1.2 1,0.8 '), [1.2, 1, 0.8]);
  for (const value of ['1 1', '1 1 1 1', '1 x 1', '1 -1 1', '1 1 1e9']) {
    assert.throws(() => parseWhiteBalance(value), { code: 'attribute', message: /red, green/ });
  }
});

test('an unknown value is rejected with the accepted values', () => {
  const rejected = (message: RegExp) => ({ name: 'PhotoError', code: 'attribute', message });
  assert.throws(() => parseLight('moon'), rejected(/“moon”.*flood, torch, checkerboard/));
  assert.throws(() => parseTone('aces'), rejected(/“aces”.*clip, filmic/));
  assert.throws(() => parseGamut('p3'), rejected(/“p3”.*srgb, display-p3/));
  for (const exposure of ['bright', '-1', 'Infinity', 'NaN', '1e300', '1.1e30']) {
    assert.throws(() => parseExposure(exposure), rejected(new RegExp(`“${exposure}”`)));
  }
});
