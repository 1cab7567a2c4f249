import assert from 'node:assert/strict';
import test from 'node:test';
import type { Loading, Reveal } from './attribute-values.js';
import { Curtain } from './reveal.js';

const asked = (loading: Loading, reveal: Reveal = 'auto') => ({ loading, reveal });

test('a photograph is fetched at once, or once it is near, or once it is seen', () => {
  const it = new Curtain();
  const may = () => (['eager', 'auto', 'lazy'] as const).map((way) => it.mayFetch(asked(way)));
  assert.deepEqual(may(), [true, false, false]);
  it.near = true;
  assert.deepEqual(may(), [true, true, false]);
  it.seen = true;
  assert.deepEqual(may(), [true, true, true]);
});

test('a poster gives way to the picture, or to a press and the picture', () => {
  const it = new Curtain();
  it.near = true;
  const down = () =>
    (['auto', 'interaction', 'manual'] as const).map((r) => it.isDown(asked('auto', r)));
  assert.deepEqual(down(), [true, true, true]);
  assert.equal(it.mayFetch(asked('auto', 'interaction')), false);
  assert.equal(it.mayFetch(asked('eager', 'interaction')), true);
  assert.equal(it.mayFetch(asked('auto', 'manual')), true);
  assert.equal(it.awaitsPress(asked('auto', 'interaction')), true);
  it.drawn = true;
  assert.deepEqual(down(), [false, true, true]);
  it.lifted = true;
  assert.deepEqual(down(), [false, false, false]);
  assert.equal(it.awaitsPress(asked('auto', 'interaction')), false);
  it.drawn = false;
  assert.deepEqual(down(), [true, true, true], 'another photograph');
});
