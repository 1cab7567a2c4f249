import assert from 'node:assert/strict';
import test from 'node:test';
import { glide, speedOf, type Velocity, VelocityTracker } from './inertia.js';

test('the velocity is that at the end of the drag', () => {
  const tracker = new VelocityTracker();
  for (let time = 0; time <= 400; time += 10) tracker.add(time < 300 ? 0 : time - 300, 50, time);
  const velocity = tracker.velocityAt(400);
  assert.ok(Math.abs(velocity.x - 1000) < 1, String(velocity.x));
  assert.equal(velocity.y, 0);
});

test('a rest before the release gives no velocity', () => {
  const tracker = new VelocityTracker();
  tracker.add(0, 0, 0);
  assert.equal(speedOf(tracker.velocityAt(0)), 0);
  tracker.add(100, 0, 20);
  assert.ok(speedOf(tracker.velocityAt(30)) > 0);
  assert.equal(speedOf(tracker.velocityAt(200)), 0);
});

test('a glide slows down, and its distance does not depend on the number of steps', () => {
  const distance = (steps: number): Velocity => {
    let velocity: Velocity = { x: 2, y: -1 };
    let [x, y] = [0, 0];
    for (let i = 0; i < steps; i += 1) {
      const next = glide(velocity, 1 / steps);
      x += next.moved.x;
      y += next.moved.y;
      assert.ok(speedOf(next.velocity) < speedOf(velocity));
      velocity = next.velocity;
    }
    return { x, y };
  };
  const [few, many] = [distance(2), distance(120)];
  assert.ok(Math.abs(few.x - many.x) < 1e-9 && Math.abs(few.y - many.y) < 1e-9);
  assert.ok(many.x > 0.5 && many.x < 2 * 0.28);
});
