import assert from 'node:assert/strict';
import test from 'node:test';
import { type PhotoState, readState, writeState } from './share-state.js';
import { WHOLE } from './viewport.js';

const NOTHING: PhotoState = {
  light: null,
  torch: null,
  size: null,
  color: null,
  exposure: null,
  view: WHOLE,
};

const ALL: PhotoState = {
  light: 'torch',
  torch: { x: 0.312, y: 0.64 },
  size: 0.25,
  color: '#ff8800',
  exposure: 1.2,
  view: { zoom: 2, x: 0.5, y: 0.41 },
};

test('what is written is read again, and may stand in an address', () => {
  const text = writeState(ALL);
  assert.equal(text, 'l=torch&x=0.312&y=0.64&s=0.25&c=ff8800&z=2&vx=0.5&vy=0.41&e=1.2');
  assert.equal(new URL(`https://a.org/#${text}`).hash, `#${text}`);
  for (const state of [ALL, NOTHING, { ...ALL, torch: { x: 0, y: 1 }, exposure: 0 }]) {
    assert.deepEqual(readState(writeState(state)), { state, faults: [] });
  }
  assert.equal(writeState(NOTHING), '');
});

test('addresses are read as they are, and with what else is in them', () => {
  assert.deepEqual(readState(`#${writeState(ALL)}&utm=1`).state, ALL);
  assert.deepEqual(readState('x=0.25').state.torch, { x: 0.25, y: 0.5 });
});

test('what cannot be counts as left out, and is told', () => {
  const { state, faults } = readState('l=moon&x=2&y=&s=0&c=zz&z=0&vx=a&vy=-1&e=-1');
  assert.deepEqual(state, NOTHING);
  assert.equal(faults.length, 9);
  assert.ok(faults.every(({ code }) => code === 'state'));
  assert.match(faults[0]?.message ?? '', /l=moon.*flood, torch/);
  const { state: half } = readState('l=torch&x=0.25&z=lots');
  assert.deepEqual([half.light, half.torch?.x, half.view], ['torch', 0.25, WHOLE]);
});
