import assert from 'node:assert/strict';
import test from 'node:test';
import { parseBackends, parseExposure, parseLight, stepTorch } from './settings.js';

test('an absent attribute means its default', () => {
  assert.equal(parseLight(null), 'flood');
  assert.deepEqual(parseBackends(null), ['webgpu', 'webgl2', 'cpu']);
  assert.deepEqual(parseBackends('  '), ['webgpu', 'webgl2', 'cpu']);
  assert.equal(parseExposure(null), 1);
});

test('an exposure may be as large as the module can take', () => {
  const largest = new Float32Array(new Uint32Array([0x7f7fffff]).buffer)[0];
  assert.equal(parseExposure(String(largest)), largest);
  assert.throws(() => parseExposure('1e300'), /from 0 to 3\.4e\+38/);
});

test('back ends keep the order they are given in, each once', () => {
  assert.deepEqual(parseBackends('cpu webgl2 cpu'), ['cpu', 'webgl2']);
});

test('unknown values are refused with the values known', () => {
  const refused = (message: RegExp) => ({ name: 'PhotoError', code: 'attribute', message });
  assert.throws(() => parseLight('moon'), refused(/“moon”.*flood, torch, checkerboard/));
  assert.throws(() => parseBackends('cpu vulkan'), refused(/“vulkan”.*webgpu, webgl2, cpu/));
  for (const exposure of ['bright', '-1', 'Infinity', 'NaN', '1e300', '3.5e38']) {
    assert.throws(() => parseExposure(exposure), refused(new RegExp(`“${exposure}”`)));
  }
});

test('arrow keys move a torch and stop at the picture’s edge', () => {
  const moved = stepTorch({ x: 0.5, y: 0.5 }, 'ArrowRight', false);
  assert.deepEqual(moved, { x: 0.55, y: 0.5 });
  assert.deepEqual(stepTorch({ x: 0.5, y: 0.005 }, 'ArrowUp', true), { x: 0.5, y: 0 });
  assert.equal(stepTorch({ x: 0.5, y: 0.5 }, 'Tab', false), undefined);
});
