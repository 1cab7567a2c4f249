import assert from 'node:assert/strict';
import test from 'node:test';
import { glide, speed, Track, type Velocity } from './inertia.js';

test('a drag is as fast as it was at its end', () => {
  const track = new Track();
  for (let time = 0; time <= 400; time += 10) track.add(time < 300 ? 0 : time - 300, 50, time);
  const velocity = track.velocity(400);
  assert.ok(Math.abs(velocity.x - 1000) < 1, String(velocity.x));
  assert.equal(velocity.y, 0);
});

test('who holds still before letting go throws nothing', () => {
  const track = new Track();
  track.add(0, 0, 0);
  assert.equal(speed(track.velocity(0)), 0);
  track.add(100, 0, 20);
  assert.ok(speed(track.velocity(30)) > 0);
  assert.equal(speed(track.velocity(200)), 0);
});

test('a glide slows down and goes as far in many steps as in few', () => {
  const far = (steps: number): Velocity => {
    let left: Velocity = { x: 2, y: -1 };
    let [x, y] = [0, 0];
    for (let i = 0; i < steps; i += 1) {
      const next = glide(left, 1 / steps);
      x += next.moved.x;
      y += next.moved.y;
      assert.ok(speed(next.left) < speed(left));
      left = next.left;
    }
    return { x, y };
  };
  const [few, many] = [far(2), far(120)];
  assert.ok(Math.abs(few.x - many.x) < 1e-9 && Math.abs(few.y - many.y) < 1e-9);
  assert.ok(many.x > 0.5 && many.x < 2 * 0.28);
});
