import assert from 'node:assert/strict';
import test from 'node:test';
import { createLoop } from './animation-fakes.js';
import { Transitions, viewBetween } from './transitions.js';

test('a transition eases to its end and then resolves', async () => {
  const { loop, frame } = createLoop();
  const transitions = new Transitions(loop);
  const shown: number[] = [];
  let isDone = false;
  const done = transitions
    .run('view', 100, (at) => shown.push(at))
    .then(() => {
      isDone = true;
    });
  frame(0);
  frame(25);
  frame(25);
  await Promise.resolve();
  assert.ok(!isDone && transitions.isRunning('view') && !transitions.isRunning('light'));
  frame(100);
  await done;
  assert.deepEqual(
    shown.map((at) => Math.round(100 * at) / 100),
    [0, 0, 0.16, 0.5, 1],
  );
  assert.ok(!transitions.isRunning('view'));
  frame(50);
  assert.equal(shown.length, 5);
});

test('another transition ends the last one where it is', async () => {
  const { loop, frame } = createLoop();
  const transitions = new Transitions(loop);
  const shown: string[] = [];
  const first = transitions.run('light', 100, () => shown.push('first'));
  frame(0);
  const second = transitions.run('light', 0, (at) => shown.push(`second ${at}`));
  await Promise.all([first, second]);
  frame(50);
  assert.deepEqual(shown, ['first', 'first', 'second 1']);
  const third = transitions.run('light', 100, () => shown.push('third'));
  transitions.end('light');
  await third;
  frame(100);
  assert.equal(shown.length, 4);
});

test('a transition that nobody sees any more is at its end', async () => {
  const { loop, frame, requests } = createLoop();
  const transitions = new Transitions(loop);
  const shown: number[] = [];
  const done = transitions.run('light', 100, (at) => shown.push(at));
  frame(0);
  transitions.finish();
  await done;
  frame(50);
  assert.deepEqual(shown, [0, 0, 1]);
  assert.equal(requests.length, 0);
});

test('a view between two others keeps the point fixed that both show at the same place', () => {
  const from = { zoom: 1, x: 0.5, y: 0.5 };
  // The point (0.2, 0.2) of the picture stays at (0.2, 0.2) of the viewport.
  const to = { zoom: 4, x: 0.275, y: 0.275 };
  for (const at of [0, 0.25, 0.5, 0.9, 1]) {
    const { zoom, x } = viewBetween(from, to, at);
    assert.ok(Math.abs((0.2 - x) * zoom + 0.5 - 0.2) < 1e-12, `at ${at}`);
  }
  assert.equal(viewBetween(from, to, 0.5).zoom, 2);
  assert.deepEqual(viewBetween(to, { ...to, x: 0.5 }, 0.5), { ...to, x: 0.3875 });
});
