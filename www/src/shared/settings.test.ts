import assert from 'node:assert/strict';
import test from 'node:test';
import {
  clampToPicture,
  parseAddress,
  parseBackends,
  parseCrossOrigin,
  parseExposure,
  parseGamut,
  parseKiosk,
  parseLight,
  parseLoading,
  parsePlace,
  parseReveal,
  parseSize,
  parseTone,
  parseWhiteBalance,
  parseZoom,
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

test('numbers have their bounds, and a name in the message', () => {
  assert.equal(parseSize(null), null);
  assert.equal(parseSize('0.2'), 0.2);
  assert.equal(parsePlace('', 'light-x'), null);
  assert.equal(parsePlace('1', 'light-x'), 1);
  assert.deepEqual([parseZoom(null), parseZoom(''), parseZoom('3')], [1, 8, 3]);
  assert.deepEqual([parseKiosk(null), parseKiosk(' '), parseKiosk('5')], [0, 60, 5]);
  assert.throws(() => parseSize('0'), { code: 'attribute', message: /light size “0”/ });
  assert.throws(() => parsePlace('1.1', 'light-y'), { message: /light-y “1.1”.*from 0 to 1;/ });
  assert.throws(() => parseZoom('0.5'), { message: /from 1 to 100; 1 shows all/ });
  assert.throws(() => parseKiosk('-1'), { code: 'attribute' });
});

test('names have their first for default', () => {
  assert.equal(parseLoading(null), 'auto');
  assert.equal(parseReveal('manual'), 'manual');
  assert.throws(() => parseLoading('later'), { message: /“later”.*auto, lazy, eager/ });
  assert.throws(() => parseReveal('now'), { message: /“now”.*auto, interaction, manual/ });
});

test('crossorigin is read as on images', () => {
  assert.equal(parseCrossOrigin(null), null);
  assert.equal(parseCrossOrigin(''), 'anonymous');
  assert.equal(parseCrossOrigin('nonsense'), 'anonymous');
  assert.equal(parseCrossOrigin('Use-Credentials'), 'use-credentials');
});

test('addresses are of the page', () => {
  assert.equal(parseAddress(' a.png ', 'poster', 'https://a.org/b/'), 'https://a.org/b/a.png');
  assert.equal(parseAddress('', 'poster', 'https://a.org/'), null);
  assert.throws(() => parseAddress('http://[', 'poster', 'https://a.org/'), {
    code: 'attribute',
    message: /“http:\/\/\[” in poster/,
  });
});

test('places are on the picture, to a ten-thousandth', () => {
  assert.deepEqual(clampToPicture({ x: -1, y: 2 }), { x: 0, y: 1 });
  assert.deepEqual(clampToPicture({ x: 1 / 3, y: 0.25 }), { x: 0.3333, y: 0.25 });
});
