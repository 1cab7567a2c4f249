import assert from 'node:assert/strict';
import test from 'node:test';
import { formatState, parseState, type ShareLinkState } from './share-link.js';
import { FULL_VIEW } from './viewport.js';

const EMPTY: ShareLinkState = {
  light: null,
  torch: null,
  size: null,
  color: null,
  exposure: null,
  view: FULL_VIEW,
};

const FULL: ShareLinkState = {
  light: 'torch',
  torch: { x: 0.312, y: 0.64 },
  size: 0.25,
  color: '#ff8800',
  exposure: 1.2,
  view: { zoom: 2, x: 0.5, y: 0.41 },
};

test('a formatted state is parsed to the same state, and is safe in an address', () => {
  const text = formatState(FULL);
  assert.equal(text, 'l=torch&x=0.312&y=0.64&r=0.25&c=ff8800&z=2&vx=0.5&vy=0.41&e=1.2');
  assert.equal(new URL(`https://a.org/#${text}`).hash, `#${text}`);
  for (const state of [FULL, EMPTY, { ...FULL, torch: { x: 0, y: 1 }, exposure: 0 }]) {
    assert.deepEqual(parseState(formatState(state)), { state, errors: [] });
  }
  assert.equal(formatState(EMPTY), '');
});

test('a leading # and unknown keys are ignored', () => {
  assert.deepEqual(parseState(`#${formatState(FULL)}&utm=1`).state, FULL);
  assert.deepEqual(parseState('x=0.25').state.torch, { x: 0.25, y: 0.5 });
});

test('a prefix keeps the states of several photographs in one address apart', () => {
  const other = { ...EMPTY, light: 'fire' } as const;
  const text = `s=window&${formatState(FULL, 'a-')}&${formatState(other, 'b-')}`;
  assert.match(text, /&a-l=torch&a-x=0\.312&.*&b-l=fire$/);
  assert.deepEqual(parseState(text, 'a-'), { state: FULL, errors: [] });
  assert.deepEqual(parseState(text, 'b-'), { state: other, errors: [] });
  assert.deepEqual(parseState(text), { state: EMPTY, errors: [] });
  assert.match(parseState('b-x=7', 'b-').errors[0]?.message ?? '', /has b-x=7\./);
});

test('an invalid value counts as absent and is reported', () => {
  const { state, errors } = parseState('l=moon&x=2&y=&r=0&c=zz&z=0&vx=a&vy=-1&e=-1');
  assert.deepEqual(state, EMPTY);
  assert.equal(errors.length, 9);
  assert.ok(errors.every(({ code }) => code === 'state'));
  assert.match(errors[0]?.message ?? '', /l=moon.*flood, torch/);
  const { state: partial } = parseState('l=torch&x=0.25&z=lots');
  assert.deepEqual([partial.light, partial.torch?.x, partial.view], ['torch', 0.25, FULL_VIEW]);
});
