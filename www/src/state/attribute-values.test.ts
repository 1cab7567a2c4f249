import assert from 'node:assert/strict';
import test from 'node:test';
import {
  parseAddress,
  parseBackends,
  parseCoordinate,
  parseCrossOrigin,
  parseKiosk,
  parseLoading,
  parseReveal,
  parseTorchSize,
  parseZoom,
} from './attribute-values.js';

test('backends keep their order without duplicates', () => {
  assert.equal(parseBackends(null), null);
  assert.equal(parseBackends('  '), null);
  assert.deepEqual(parseBackends('cpu webgl2 cpu'), ['cpu', 'webgl2']);
  assert.throws(() => parseBackends('cpu vulkan'), {
    name: 'PhotoError',
    code: 'attribute',
    message: /“vulkan”.*webgpu, webgl2, cpu/,
  });
});

test('numbers have bounds, and the message names the attribute', () => {
  assert.equal(parseTorchSize(null), null);
  assert.equal(parseTorchSize('0.2'), 0.2);
  assert.equal(parseCoordinate('', 'light-x'), null);
  assert.equal(parseCoordinate('1', 'light-x'), 1);
  assert.deepEqual([parseZoom(null), parseZoom(''), parseZoom('3')], [1, 8, 3]);
  assert.deepEqual([parseKiosk(null), parseKiosk(' '), parseKiosk('5')], [0, 60, 5]);
  assert.throws(() => parseTorchSize('0'), { code: 'attribute', message: /light size “0”/ });
  assert.throws(() => parseCoordinate('1.1', 'light-y'), {
    message: /light-y “1.1”.*from 0 to 1;/,
  });
  assert.throws(() => parseZoom('0.5'), { message: /from 1 to 100; 1 disables zooming/ });
  assert.throws(() => parseKiosk('-1'), { code: 'attribute' });
});

test('the first name is the default', () => {
  assert.equal(parseLoading(null), 'auto');
  assert.equal(parseReveal('manual'), 'manual');
  assert.throws(() => parseLoading('later'), { message: /“later”.*auto, lazy, eager/ });
  assert.throws(() => parseReveal('now'), { message: /“now”.*auto, interaction, manual/ });
});

test('crossorigin is parsed as on images', () => {
  assert.equal(parseCrossOrigin(null), null);
  assert.equal(parseCrossOrigin(''), 'anonymous');
  assert.equal(parseCrossOrigin('nonsense'), 'anonymous');
  assert.equal(parseCrossOrigin('Use-Credentials'), 'use-credentials');
});

test('addresses are resolved against the page', () => {
  assert.equal(parseAddress(' a.png ', 'poster', 'https://a.org/b/'), 'https://a.org/b/a.png');
  assert.equal(parseAddress('', 'poster', 'https://a.org/'), null);
  assert.throws(() => parseAddress('http://[', 'poster', 'https://a.org/'), {
    code: 'attribute',
    message: /“http:\/\/\[” in poster/,
  });
});
