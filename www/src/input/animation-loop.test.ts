import assert from 'node:assert/strict';
import test from 'node:test';
import { createLoop } from './animation-fakes.js';

test('a step receives the elapsed time until the animation ends', () => {
  const { loop, frame, requests } = createLoop();
  const times: number[] = [];
  loop.set('a', (seconds) => times.push(seconds) < 3);
  for (let i = 0; i < 9; i += 1) frame(20);
  assert.deepEqual(times, [0, 0.02, 0.02]);
  assert.equal(requests.length, 0, 'no frame is requested without an animation');
});

test('a suspended animation continues where it was', () => {
  const { loop, frame, requests } = createLoop();
  const times: number[] = [];
  loop.set('a', (seconds) => times.push(seconds) > 0);
  frame(20);
  loop.isEnabled = false;
  frame(20);
  assert.equal(requests.length, 0);
  frame(60_000);
  loop.isEnabled = true;
  frame(20);
  frame(20);
  assert.deepEqual(times, [0, 0, 0.02]);
});
