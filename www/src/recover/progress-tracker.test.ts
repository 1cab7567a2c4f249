import assert from 'node:assert/strict';
import test from 'node:test';
import { ProgressTracker } from './progress-tracker.js';
import type { RecoveryProgress } from './types.js';

const STAGES = [
  ['reading', 1],
  ['preparing', 3],
  ['recovering', 6],
] as const;

function track() {
  const clock = { ms: 0 };
  let last: RecoveryProgress | undefined;
  const tracker = new ProgressTracker(
    STAGES,
    (progress) => {
      last = progress;
    },
    () => clock.ms,
  );
  return { clock, tracker, last: () => last as RecoveryProgress };
}

test('the fraction is that of the expected times', () => {
  const { clock, tracker, last } = track();
  tracker.begin('reading');
  assert.deepEqual(last(), { stage: 'reading', fraction: 0, secondsLeft: undefined });
  clock.ms = 500;
  tracker.report(0.5);
  assert.deepEqual(last(), { stage: 'reading', fraction: 0.05, secondsLeft: 9.5 });
  clock.ms = 1000;
  tracker.begin('preparing');
  assert.deepEqual(last(), { stage: 'preparing', fraction: 0.1, secondsLeft: 9 });
  clock.ms = 2500;
  tracker.report();
  assert.deepEqual(last(), { stage: 'preparing', fraction: 0.25, secondsLeft: 7.5 });
});

test('a slow device corrects the time that is left', () => {
  const { clock, tracker, last } = track();
  tracker.begin('preparing');
  clock.ms = 6000;
  tracker.begin('recovering');
  assert.equal(last().secondsLeft, 12);
  clock.ms = 10_000;
  tracker.report(0.25);
  assert.equal(last().secondsLeft, 12);
});

test('a stage of unknown length comes near its end, but never reaches it', () => {
  const { clock, tracker, last } = track();
  tracker.begin('preparing');
  let fraction = 0;
  for (const seconds of [1, 2, 3, 6, 20]) {
    clock.ms = 1000 * seconds;
    tracker.report();
    assert.ok(last().fraction > fraction && last().fraction < 0.4);
    ({ fraction } = last());
  }
});
