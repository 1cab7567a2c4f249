import assert from 'node:assert/strict';
import test from 'node:test';
import type { PicturePoint } from '../shared/value-types.js';
import { type DeviceAngles, TiltTracker } from './tilt.js';

/** The torch's position after the smoothing has settled. */
function settle(tracker: TiltTracker, angles: DeviceAngles, angle = 0): PicturePoint {
  let at = tracker.update(angles, angle);
  for (let i = 0; i < 60; i += 1) at = tracker.update(angles, angle);
  return { x: Math.round(100 * at.x) / 100, y: Math.round(100 * at.y) / 100 };
}

test('the torch begins in the centre and follows the tilt', () => {
  const tracker = new TiltTracker();
  assert.deepEqual(settle(tracker, { beta: 40, gamma: -10 }), { x: 0.5, y: 0.5 });
  assert.deepEqual(settle(tracker, { beta: 40, gamma: 2.5 }), { x: 0.75, y: 0.5 });
  assert.deepEqual(settle(tracker, { beta: 27.5, gamma: -10 }), { x: 0.5, y: 0.25 });
  assert.deepEqual(settle(tracker, { beta: 120, gamma: -10 }), { x: 0.5, y: 1 });
});

test('the position accounts for a rotated screen', () => {
  const tracker = new TiltTracker();
  tracker.update({ beta: 0, gamma: 0 }, 90);
  assert.deepEqual(settle(tracker, { beta: 12.5, gamma: 0 }, 90), { x: 0.75, y: 0.5 });
});

test('angles that wrap around do not make the torch jump', () => {
  const tracker = new TiltTracker();
  tracker.update({ beta: 178, gamma: 88 }, 0);
  const at = settle(tracker, { beta: -178, gamma: -88 });
  assert.deepEqual(at, { x: 0.58, y: 0.58 });
});
