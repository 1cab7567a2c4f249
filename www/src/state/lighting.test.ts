import assert from 'node:assert/strict';
import test from 'node:test';
import { PENDING_IMAGE } from '../lights/image-light.js';
import { isVideoAddress } from '../lights/light-media.js';
import type { LinearLight } from '../lights/light-source.js';
import * as sources from '../lights/light-sources.js';
import type { PhotoError } from '../shared/errors.js';
import { Lighting } from './lighting.js';
import type { AskedLight } from './options.js';

const ASKED: AskedLight = {
  name: 'torch',
  src: null,
  place: { x: 0.2, y: 0.3 },
  size: 0.1,
  color: null,
};
const RED = { factors: [1, 0, 0], hex: '#ff0000' } as const;
const SOURCE: LinearLight = { data: new Float32Array(3), width: 1, height: 1 };

function lighting(asked = ASKED, fetch = async () => sources) {
  const told: string[] = [];
  const listener = {
    changed: () => told.push('changed'),
    came: () => {
      told.push('came');
      it.ask(asked, null);
    },
    errorChanged: (fault: PhotoError | null) => told.push(fault?.code ?? 'well'),
  };
  const it = new Lighting(listener, fetch);
  it.ask(asked, null);
  return Object.assign(it, { told });
}

const settle = () => new Promise((resolve) => setImmediate(resolve));

test('light is as the page asks, until somebody chooses, and again after that', () => {
  const it = lighting();
  assert.deepEqual(it.setting, { name: 'torch', torch: ASKED.place, image: null, size: 0.1 });
  it.choose({ name: 'stripes', torch: { x: 0.5, y: 0.5 }, color: RED });
  assert.deepEqual(it.setting, { name: 'stripes', torch: null, image: null });
  assert.equal(it.color, RED);
  it.item = 'torch';
  assert.deepEqual(it.torch, { x: 0.5, y: 0.5 });
  it.ask(ASKED, null);
  assert.equal(it.torch?.x, 0.5, 'nothing new is asked');
  it.choose({ torch: null });
  it.ask({ ...ASKED, place: { x: 0.9, y: 0.9 } }, null);
  assert.equal(it.torch?.x, 0.9);
  it.reset();
  assert.deepEqual(it.setting, {
    name: 'torch',
    torch: { x: 0.9, y: 0.9 },
    image: null,
    size: 0.1,
  });
  assert.equal(it.color, null);
});

test('a source stands in for built-in lights until one is chosen', async () => {
  const it = lighting();
  assert.ok(it.holdsTorch && !it.items.includes('projection'));
  it.source = SOURCE;
  assert.deepEqual([it.item, it.items[0], it.holdsTorch], ['projection', 'projection', false]);
  // What follows it is on its way, and the light is as it was until then.
  assert.equal(it.setting.image, PENDING_IMAGE);
  await settle();
  assert.deepEqual(it.told, ['came']);
  assert.ok(it.setting.image && it.setting.image !== PENDING_IMAGE);
  assert.equal(it.shining, SOURCE);
  it.item = 'flood';
  assert.deepEqual([it.setting.image, it.item], [null, 'flood']);
  it.item = 'projection';
  assert.equal(it.shining, SOURCE);
  it.item = 'fire';
  it.ask({ ...ASKED, name: 'spectrum' }, null);
  it.choose({ name: null });
  assert.equal(it.shining, SOURCE);
  it.source = null;
  assert.equal(it.item, 'spectrum');
});

test('what follows sources is fetched for none but them, once, and again where it did not come', async () => {
  let fetched = 0;
  let offline = true;
  const it = lighting(ASKED, async () => {
    fetched += 1;
    if (offline) throw new Error('offline');
    return sources;
  });
  await settle();
  assert.equal(fetched, 0);
  it.source = SOURCE;
  await settle();
  it.choose({});
  await settle();
  assert.deepEqual([it.told, fetched], [['light-source'], 1]);
  assert.match(it.fault?.message ?? '', /offline.*beside the element's/);
  assert.equal(it.setting.image, PENDING_IMAGE, 'the last light stays');
  it.source = null;
  assert.equal(it.fault, null);
  offline = false;
  it.source = SOURCE;
  await settle();
  assert.deepEqual([it.told.at(-1), fetched, it.fault], ['came', 2, null]);
});

test('fire burns where it shines', () => {
  const it = lighting({ ...ASKED, name: 'fire' });
  assert.ok(it.burns && it.canPlay);
  assert.equal(it.burn(0.01), false);
  assert.equal(it.burn(0.03), true);
  assert.equal(it.setting.seconds, 0.04);
  it.source = SOURCE;
  assert.ok(!it.burns && !it.canPlay);
});

test('films are told by the end of their address', () => {
  for (const film of ['a.mp4', 'a.M4V', 'a.webm?x=1', 'b/a.ogv#t=2', 'a.mov']) {
    assert.ok(isVideoAddress(new URL(film, 'https://a.org').href), film);
  }
  assert.ok(!isVideoAddress('https://a.org/a.png?b=c.mp4'));
});
