import assert from 'node:assert/strict';
import test from 'node:test';
import {
  clampView,
  FULL_VIEW,
  pan,
  pointAt,
  positionOf,
  toggleZoom,
  toPicture,
  toViewport,
  viewOf,
  wheelFactor,
  type ZoomView,
  zoomAt,
} from './viewport.js';

const CLOSE: ZoomView = { zoom: 4, x: 0.4, y: 0.6 };

function near(a: number, b: number): void {
  assert.ok(Math.abs(a - b) < 1e-3, `${a} and ${b}`);
}

test('positions on the page are points of the picture', () => {
  const box = { left: 10, top: 20, width: 100, height: 200 };
  assert.deepEqual(pointAt(FULL_VIEW, box, { x: 35, y: 120 }), { x: 0.25, y: 0.5 });
  assert.deepEqual(positionOf(FULL_VIEW, box, { x: 0.25, y: 0.5 }), { x: 35, y: 120 });
  const corner = pointAt(CLOSE, box, { x: 10, y: 220 });
  near(corner?.x ?? 0, 0.4 - 0.125);
  near(corner?.y ?? 0, 0.6 + 0.125);
  near(positionOf(CLOSE, box, { x: 0.65, y: 0.6 }).x, 160);
  for (const [x, y] of [
    [9, 120],
    [111, 120],
    [35, 19],
    [35, 221],
  ] as const) {
    assert.equal(pointAt(CLOSE, box, { x, y }), null);
  }
});

test('toPicture and toViewport are inverse', () => {
  for (const at of [FULL_VIEW, { x: 0, y: 1 }, { x: 0.3, y: 0.9 }]) {
    const point = toViewport(CLOSE, toPicture(CLOSE, at));
    near(point.x, at.x);
    near(point.y, at.y);
  }
  assert.deepEqual(toPicture(CLOSE, { x: 0.5, y: 0.5 }), { x: 0.4, y: 0.6 });
  assert.deepEqual(toPicture(FULL_VIEW, { x: 0.2, y: 0.7 }), { x: 0.2, y: 0.7 });
});

test('zooming keeps the point under the pointer fixed', () => {
  const at = { x: 0.7, y: 0.4 };
  const before = toPicture(CLOSE, at);
  const after = toPicture(zoomAt(CLOSE, 1.3, at, 8), at);
  near(after.x, before.x);
  near(after.y, before.y);
});

test('a view stays inside the picture and within the maximum zoom', () => {
  assert.deepEqual(clampView({ zoom: 0.2, x: 0, y: 9 }, 8), FULL_VIEW);
  assert.deepEqual(clampView({ zoom: 99, x: 0, y: 1 }, 8), { zoom: 8, x: 0.0625, y: 0.9375 });
  assert.deepEqual(clampView(pan({ zoom: 2, x: 0.5, y: 0.5 }, 9, -9), 8), {
    zoom: 2,
    x: 0.25,
    y: 0.75,
  });
  assert.deepEqual(clampView(zoomAt(CLOSE, 0.01, { x: 0, y: 0 }, 8), 8), FULL_VIEW);
});

test('a panned picture follows the pointer', () => {
  const at = { x: 0.5, y: 0.5 };
  const before = toPicture(CLOSE, at);
  const after = toPicture(pan(CLOSE, 0.1, -0.1), { x: 0.6, y: 0.4 });
  near(after.x, before.x);
  near(after.y, before.y);
});

test('a part of the picture is shown as large as possible', () => {
  assert.deepEqual(viewOf({ x: 0.5, y: 0.25, width: 0.25, height: 0.125 }), {
    zoom: 4,
    x: 0.625,
    y: 0.3125,
  });
});

test('far into a large picture, views are finer than its pixels', () => {
  const { x } = clampView({ zoom: 16, x: 0.4 + 1 / 65536, y: 0.5 }, 16);
  assert.ok(Math.abs(x - 0.4 - 1 / 65536) < 1e-6);
});

test('a double tap zooms in at its point, and out again', () => {
  const at = { x: 0.8, y: 0.5 };
  const closer = toggleZoom(FULL_VIEW, at, 8);
  assert.equal(closer.zoom, 2.5);
  near(toPicture(closer, at).x, 0.8);
  assert.deepEqual(toggleZoom(closer, at, 8), FULL_VIEW);
  assert.equal(toggleZoom(FULL_VIEW, at, 2).zoom, 2);
});

test('a wheel zooms equally by lines and by pixels, with a limit for one event', () => {
  assert.equal(wheelFactor(-120, 0), wheelFactor(-3, 1));
  assert.equal(wheelFactor(1e6, 0), wheelFactor(1, 2));
  near(wheelFactor(-100, 0) * wheelFactor(100, 0), 1);
  assert.ok(wheelFactor(-50, 0) > 1);
});
