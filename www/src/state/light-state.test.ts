import assert from 'node:assert/strict';
import test from 'node:test';
import * as sourceSupport from '../lights/image-light-entry.js';
import { isVideoAddress } from '../lights/light-media.js';
import { PENDING_IMAGE } from '../lights/light-setting.js';
import type { LinearImage } from '../lights/light-source.js';
import type { PhotoError } from '../shared/errors.js';
import { LightState } from './light-state.js';
import type { LightAttributes } from './options.js';
import { NO_OVERRIDES, parsePageLight } from './page-light.js';

const OPTIONS: LightAttributes = {
  name: 'torch',
  src: null,
  crossOrigin: null,
  torch: { x: 0.2, y: 0.3 },
  size: 0.1,
  color: null,
};
const RED = { factors: [1, 0, 0], hex: '#ff0000' } as const;
const SOURCE: LinearImage = { data: new Float32Array(3), width: 1, height: 1 };

function createLight(options = OPTIONS, fetchSupport = async () => sourceSupport) {
  const calls: string[] = [];
  const listener = {
    changed: () => calls.push('changed'),
    loaded: () => {
      calls.push('loaded');
      light.setOptions(options);
    },
    errorChanged: (error: PhotoError | null) => calls.push(error?.code ?? 'no error'),
  };
  const light = new LightState(listener, fetchSupport);
  light.setOptions(options);
  return Object.assign(light, { calls });
}

/** Stands for the browser's class in tests with an image as the light. */
class FakeImage extends EventTarget {
  src = '';
  removeAttribute(): void {}
}

const settle = () => new Promise((resolve) => setImmediate(resolve));

test('the light follows the options, except where it is overridden', () => {
  const light = createLight();
  assert.deepEqual(light.setting, { name: 'torch', torch: OPTIONS.torch, image: null, size: 0.1 });
  light.override({ name: 'stripes', torch: { x: 0.5, y: 0.5 }, color: RED });
  assert.deepEqual(light.setting, { name: 'stripes', torch: null, image: null });
  assert.equal(light.color, RED);
  light.item = 'torch';
  assert.deepEqual(light.torch, { x: 0.5, y: 0.5 });
  light.setOptions(OPTIONS);
  assert.equal(light.torch?.x, 0.5, 'the options are unchanged');
  light.override({ torch: null });
  light.setOptions({ ...OPTIONS, torch: { x: 0.9, y: 0.9 } });
  assert.equal(light.torch?.x, 0.9);
  light.reset();
  assert.deepEqual(light.setting, {
    name: 'torch',
    torch: { x: 0.9, y: 0.9 },
    image: null,
    size: 0.1,
  });
  assert.equal(light.color, null);
});

test('the setting is a new object only after a change', () => {
  const light = createLight();
  const { setting } = light;
  light.setOptions({ ...OPTIONS });
  light.reset();
  assert.equal(light.setting, setting);
  light.torch = { x: 0.5, y: 0.5 };
  const moved = light.setting;
  assert.notEqual(moved, setting);
  light.torch = { x: 0.5, y: 0.50001 };
  assert.equal(light.setting, moved, 'the same point after rounding');
});

test('a source replaces the built-in lights until one of them is selected', async () => {
  const light = createLight();
  assert.ok(light.isTorch && !light.items.includes('projection'));
  light.page = { ...NO_OVERRIDES, source: SOURCE };
  assert.deepEqual(
    [light.item, light.items[0], light.isTorch],
    ['projection', 'projection', false],
  );
  // The support is being fetched; the last light stays until then.
  assert.equal(light.setting.image, PENDING_IMAGE);
  await settle();
  assert.deepEqual(light.calls, ['loaded']);
  assert.ok(light.setting.image && light.setting.image !== PENDING_IMAGE);
  assert.equal(light.activeSource, SOURCE);
  light.item = 'flood';
  assert.deepEqual([light.setting.image, light.item], [null, 'flood']);
  light.item = 'projection';
  assert.equal(light.activeSource, SOURCE);
  light.item = 'fire';
  light.setOptions({ ...OPTIONS, name: 'spectrum' });
  light.override({ name: null });
  assert.equal(light.activeSource, SOURCE);
  light.page = { ...NO_OVERRIDES, source: null };
  assert.equal(light.item, 'spectrum');
});

test('the light of the script lies between the options and the visitor', async (t) => {
  Object.assign(globalThis, { Image: FakeImage });
  t.after(() => Reflect.deleteProperty(globalThis, 'Image'));
  const light = createLight({ ...OPTIONS, src: 'https://a.org/a.png' });
  await settle();
  assert.equal(light.item, 'projection');
  light.page = parsePageLight({ name: 'torch', x: 0.75 }, light.options);
  assert.deepEqual([light.item, light.torch], ['torch', { x: 0.75, y: 0.3 }]);
  assert.ok(!light.items.includes('projection'), 'a name replaces the source of the options');
  light.override({ name: 'fire', torch: { x: 0, y: 0 } });
  light.page = parsePageLight('spectrum', light.options);
  assert.deepEqual([light.item, light.torch], ['spectrum', { x: 0, y: 0 }]);
  light.reset();
  assert.deepEqual([light.item, light.torch], ['spectrum', { x: 0.2, y: 0.3 }]);
  light.override({ torch: { x: 0, y: 0 } });
  light.page = parsePageLight(null, light.options);
  assert.deepEqual([light.item, light.torch], ['projection', { x: 0.2, y: 0.3 }]);
  light.page = parsePageLight({ name: 'fire', size: 0.5 }, light.options);
  light.clear('size');
  assert.deepEqual([light.item, light.size], ['fire', 0.1], 'an attribute was changed');
  light.clear('name');
  assert.equal(light.item, 'projection');
});

test('an invalid light of the script names the field', () => {
  const parse = (value: unknown) => parsePageLight(value as never, OPTIONS);
  assert.throws(() => parse({ x: Number.NaN }), /TypeError: light\.x must be a finite number/);
  assert.throws(() => parse('moon'), /“moon”/);
  assert.throws(
    () => parse({ name: 'torch', radius: 1 }),
    /TypeError: light must be null, the name/,
  );
  assert.throws(() => parse('torch') && parse(7), /TypeError: light must be/);
});

test('the support for sources is fetched once when needed, and again after a failure', async () => {
  let fetches = 0;
  let offline = true;
  const light = createLight(OPTIONS, async () => {
    fetches += 1;
    if (offline) throw new Error('offline');
    return sourceSupport;
  });
  await settle();
  assert.equal(fetches, 0);
  light.page = { ...NO_OVERRIDES, source: SOURCE };
  await settle();
  light.override({});
  await settle();
  assert.deepEqual([light.calls, fetches], [['light-source'], 1]);
  assert.match(light.error?.message ?? '', /offline.*the element's script/);
  assert.equal(light.setting.image, PENDING_IMAGE, 'the last light stays');
  light.page = { ...NO_OVERRIDES, source: null };
  assert.equal(light.error, null);
  offline = false;
  light.page = { ...NO_OVERRIDES, source: SOURCE };
  await settle();
  assert.deepEqual([light.calls.at(-1), fetches, light.error], ['loaded', 2, null]);
});

test('a fire advances only while it is the light', () => {
  const light = createLight({ ...OPTIONS, name: 'fire' });
  assert.ok(light.isFire && light.isPlayable);
  assert.equal(light.advanceFire(0.01), false);
  assert.equal(light.advanceFire(0.03), true);
  assert.equal(light.setting.seconds, 0.04);
  light.page = { ...NO_OVERRIDES, source: SOURCE };
  assert.ok(!light.isFire && !light.isPlayable);
});

test('videos are recognised by the extension of their address', () => {
  for (const video of ['a.mp4', 'a.M4V', 'a.webm?x=1', 'b/a.ogv#t=2', 'a.mov']) {
    assert.ok(isVideoAddress(new URL(video, 'https://a.org').href), video);
  }
  assert.ok(!isVideoAddress('https://a.org/a.png?b=c.mp4'));
});
