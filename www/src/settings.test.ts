import assert from 'node:assert/strict';
import test from 'node:test';
import {
  parseBackends,
  parseExposure,
  parseGamut,
  parseLight,
  parseTone,
  parseWhiteBalance,
  stepTorch,
} from './settings.js';

test('an absent attribute means its default', () => {
  assert.equal(parseLight(null), 'flood');
  assert.equal(parseBackends(null), null);
  assert.equal(parseBackends('  '), null);
  assert.equal(parseExposure(null), 1);
  assert.deepEqual(parseWhiteBalance(null), [1, 1, 1]);
  assert.equal(parseTone(''), 'clip');
  assert.equal(parseGamut(null), 'srgb');
});

test('a white balance is three factors', () => {
  assert.deepEqual(parseWhiteBalance(' 1.2 1,0.8 '), [1.2, 1, 0.8]);
  for (const value of ['1 1', '1 1 1 1', '1 x 1', '1 -1 1', '1 1 1e9']) {
    assert.throws(() => parseWhiteBalance(value), { code: 'attribute', message: /red, green/ });
  }
});

test('back ends keep the order they are given in, each once', () => {
  assert.deepEqual(parseBackends('cpu webgl2 cpu'), ['cpu', 'webgl2']);
});

test('unknown values are refused with the values known', () => {
  const refused = (message: RegExp) => ({ name: 'PhotoError', code: 'attribute', message });
  assert.throws(() => parseLight('moon'), refused(/“moon”.*flood, torch, checkerboard/));
  assert.throws(() => parseBackends('cpu vulkan'), refused(/“vulkan”.*webgpu, webgl2, cpu/));
  assert.throws(() => parseTone('aces'), refused(/“aces”.*clip, filmic/));
  assert.throws(() => parseGamut('p3'), refused(/“p3”.*srgb, display-p3/));
  for (const exposure of ['bright', '-1', 'Infinity', 'NaN', '1e300', '1.1e30']) {
    assert.throws(() => parseExposure(exposure), refused(new RegExp(`“${exposure}”`)));
  }
});

test('arrow keys move a torch and stop at the picture’s edge', () => {
  const moved = stepTorch({ x: 0.5, y: 0.5 }, 'ArrowRight', false);
  assert.deepEqual(moved, { x: 0.55, y: 0.5 });
  assert.deepEqual(stepTorch({ x: 0.5, y: 0.005 }, 'ArrowUp', true), { x: 0.5, y: 0 });
  assert.equal(stepTorch({ x: 0.5, y: 0.5 }, 'Tab', false), undefined);
});
