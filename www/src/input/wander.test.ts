import assert from 'node:assert/strict';
import test from 'node:test';
import { breathe, Idle, REST_MS } from './wander.js';

function idle() {
  let now = 0;
  const timers = new Map<() => void, number>();
  const log: string[] = [];
  const it = new Idle(
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
  return { it, pass, timers };
}

test('a kiosk goes back once after the last touch, and only where somebody was', () => {
  const { it, pass } = idle();
  it.kiosk = 20;
  assert.deepEqual(pass(60_000), []);
  it.touch();
  assert.deepEqual(pass(REST_MS), ['rested']);
  it.touch();
  assert.deepEqual(pass(19_000), ['rested']);
  assert.deepEqual(pass(1000), ['expired']);
  assert.deepEqual(pass(60_000), []);
});

test('waiting is another where the page asks for another', () => {
  const { it, pass, timers } = idle();
  it.touch();
  it.kiosk = 10;
  assert.deepEqual(pass(10_000), ['rested', 'expired']);
  it.touch();
  it.kiosk = 0;
  assert.deepEqual(pass(100_000), ['rested']);
  it.touch();
  it.stop();
  assert.equal(timers.size, 0);
});

test('a breathing light sets out from where it was, and stays on the picture', () => {
  const from = { x: 0, y: 1 };
  assert.deepEqual(breathe(from, 0), from);
  for (let seconds = 0; seconds < 120; seconds += 1 / 30) {
    const a = breathe(from, seconds);
    const b = breathe(from, seconds + 1 / 30);
    assert.ok(a.x >= 0 && a.x <= 1 && a.y >= 0 && a.y <= 1);
    assert.ok(Math.hypot(b.x - a.x, b.y - a.y) < 0.02, 'slowly');
  }
  const later = breathe(from, 10);
  assert.ok(Math.hypot(later.x, later.y - 1) > 0.2);
});
