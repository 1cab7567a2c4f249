import assert from 'node:assert/strict';
import test from 'node:test';
import { IdleTimer, REST_MS } from './idle-timer.js';

function createTimer() {
  let now = 0;
  const timers = new Map<() => void, number>();
  const log: string[] = [];
  const timer = new IdleTimer(
    (ms, callback) => {
      timers.set(callback, now + ms);
      return () => timers.delete(callback);
    },
    { rested: () => log.push('rested'), expired: () => log.push('expired') },
  );
  const pass = (ms: number) => {
    now += ms;
    for (const [callback, due] of timers) if (due <= now && timers.delete(callback)) callback();
    return log.splice(0);
  };
  return { timer, pass, timers };
}

test('the kiosk time expires once after the last input, and never without input', () => {
  const { timer, pass } = createTimer();
  timer.kioskSeconds = 20;
  assert.deepEqual(pass(60_000), []);
  timer.restart();
  assert.deepEqual(pass(REST_MS), ['rested']);
  timer.restart();
  assert.deepEqual(pass(19_000), ['rested']);
  assert.deepEqual(pass(1000), ['expired']);
  assert.deepEqual(pass(60_000), []);
});

test('a new kiosk time applies at once', () => {
  const { timer, pass, timers } = createTimer();
  timer.restart();
  timer.kioskSeconds = 10;
  assert.deepEqual(pass(10_000), ['rested', 'expired']);
  timer.restart();
  timer.kioskSeconds = 0;
  assert.deepEqual(pass(100_000), ['rested']);
  timer.restart();
  timer.stop();
  assert.equal(timers.size, 0);
});
