import assert from 'node:assert/strict';
import test from 'node:test';
import type { PicturePoint } from '../shared/values.js';
import { type Pose, Tilt } from './tilt.js';

/** Where the light comes to rest. */
function held(tilt: Tilt, pose: Pose, angle = 0): PicturePoint {
  let at = tilt.turn(pose, angle);
  for (let i = 0; i < 60; i += 1) at = tilt.turn(pose, angle);
  return { x: Math.round(100 * at.x) / 100, y: Math.round(100 * at.y) / 100 };
}

test('the light begins in the middle however the device is held, and follows it', () => {
  const tilt = new Tilt();
  assert.deepEqual(held(tilt, { beta: 40, gamma: -10 }), { x: 0.5, y: 0.5 });
  assert.deepEqual(held(tilt, { beta: 40, gamma: 2.5 }), { x: 0.75, y: 0.5 });
  assert.deepEqual(held(tilt, { beta: 27.5, gamma: -10 }), { x: 0.5, y: 0.25 });
  assert.deepEqual(held(tilt, { beta: 120, gamma: -10 }), { x: 0.5, y: 1 });
});

test('a screen that is turned has its own right and left', () => {
  const tilt = new Tilt();
  tilt.turn({ beta: 0, gamma: 0 }, 90);
  assert.deepEqual(held(tilt, { beta: 12.5, gamma: 0 }, 90), { x: 0.75, y: 0.5 });
});

test('angles that jump at their end do not throw the light', () => {
  const tilt = new Tilt();
  tilt.turn({ beta: 178, gamma: 88 }, 0);
  const at = held(tilt, { beta: -178, gamma: -88 });
  assert.deepEqual(at, { x: 0.58, y: 0.58 });
});
