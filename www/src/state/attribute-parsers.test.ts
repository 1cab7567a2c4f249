import assert from 'node:assert/strict';
import test from 'node:test';
import { PARSERS, parseAddress } from './attribute-parsers.js';

test('backends keep their order without duplicates', () => {
  assert.equal(PARSERS.backend(null), null);
  assert.equal(PARSERS.backend('  '), null);
  assert.deepEqual(PARSERS.backend('cpu webgl2 cpu'), ['cpu', 'webgl2']);
  assert.throws(() => PARSERS.backend('cpu vulkan'), {
    name: 'PhotoError',
    code: 'attribute',
    message: /“vulkan”.*webgpu, webgl2, cpu/,
  });
});

test('numbers have bounds, and the message names the attribute', () => {
  assert.equal(PARSERS['light-size'](null), null);
  assert.equal(PARSERS['light-size']('0.2'), 0.2);
  assert.equal(PARSERS['light-x'](''), null);
  assert.equal(PARSERS['light-x']('1'), 1);
  assert.deepEqual([PARSERS.zoom(null), PARSERS.zoom(''), PARSERS.zoom('3')], [1, null, 3]);
  assert.deepEqual([PARSERS.kiosk(null), PARSERS.kiosk(' '), PARSERS.kiosk('5')], [0, 60, 5]);
  assert.throws(() => PARSERS['light-size']('0'), { code: 'attribute', message: /light size “0”/ });
  assert.throws(() => PARSERS['light-y']('1.1'), {
    message: /light-y “1.1”.*from 0 to 1;/,
  });
  assert.throws(() => PARSERS.zoom('0.5'), { message: /from 1 to 100; 1 disables zooming/ });
  assert.throws(() => PARSERS.kiosk('-1'), { code: 'attribute' });
});

test('the first name is the default', () => {
  assert.equal(PARSERS.loading(null), 'eager');
  assert.equal(PARSERS.reveal('manual'), 'manual');
  assert.throws(() => PARSERS.loading('later'), { message: /“later”.*eager, lazy/ });
  assert.throws(() => PARSERS.reveal('now'), { message: /“now”.*auto, interaction, manual/ });
});

test('crossorigin is parsed as on images', () => {
  assert.equal(PARSERS.crossorigin(null), null);
  assert.equal(PARSERS.crossorigin(''), 'anonymous');
  assert.equal(PARSERS.crossorigin('nonsense'), 'anonymous');
  assert.equal(PARSERS.crossorigin('Use-Credentials'), 'use-credentials');
});

test('addresses are resolved against the page', () => {
  assert.equal(parseAddress(' a.png ', 'poster', 'https://a.org/b/'), 'https://a.org/b/a.png');
  assert.equal(parseAddress('', 'poster', 'https://a.org/'), null);
  assert.throws(() => parseAddress('http://[', 'poster', 'https://a.org/'), {
    code: 'attribute',
    message: /“http:\/\/\[” in poster/,
  });
});
