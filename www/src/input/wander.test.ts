import assert from 'node:assert/strict';
import test from 'node:test';
import { wander } from './wander.js';

test('the path begins at the start, is slow and stays on the picture', () => {
  const start = { x: 0, y: 1 };
  assert.deepEqual(wander(start, 0), start);
  for (let seconds = 0; seconds < 120; seconds += 1 / 30) {
    const a = wander(start, seconds);
    const b = wander(start, seconds + 1 / 30);
    assert.ok(a.x >= 0 && a.x <= 1 && a.y >= 0 && a.y <= 1);
    assert.ok(Math.hypot(b.x - a.x, b.y - a.y) < 0.02, 'slowly');
  }
  const later = wander(start, 10);
  assert.ok(Math.hypot(later.x, later.y - 1) > 0.2);
});
