import assert from 'node:assert/strict';
import test from 'node:test';
import { type EnabledGestures, GestureRecognizer, type PointerSample } from './gestures.js';

const ALL: EnabledGestures = { movesLight: true, zooms: true, isZoomed: true };

/** A recognizer, and the calls of its listener since the last check. */
function createRecognizer() {
  const log: string[] = [];
  let holds = 0;
  const round = (...values: number[]) => values.map((value) => Math.round(100 * value) / 100);
  const recognizer = new GestureRecognizer({
    moveLight: (x, y) => log.push(`light ${x} ${y}`),
    restoreLight: () => log.push('restore'),
    throwLight: ({ x, y }) => log.push(`throw ${round(x, y).join(' ')}`),
    pan: (dx, dy) => log.push(`pan ${dx} ${dy}`),
    throwView: ({ x, y }) => log.push(`throw view ${round(x, y).join(' ')}`),
    holdView: () => {
      holds += 1;
    },
    zoom: (factor, x, y) => log.push(`zoom ${round(factor).join()} at ${x} ${y}`) > 0,
    doubleTap: (x, y) => log.push(`double ${x} ${y}`),
  });
  return { recognizer, calls: () => log.splice(0), holds: () => holds };
}

function at(
  x: number,
  y: number,
  time = 0,
  kind: 'touch' | 'mouse' | 'pen' = 'touch',
  id = 1,
): PointerSample {
  return { id, isTouch: kind === 'touch', x, y, time };
}

test('a finger moves the light', () => {
  const { recognizer, calls } = createRecognizer();
  recognizer.down(at(10, 20), ALL);
  recognizer.move(at(30, 20, 10), ALL);
  assert.deepEqual(calls(), ['light 10 20', 'light 30 20']);
  recognizer.up(at(30, 20, 500), ALL);
  assert.deepEqual(calls(), [], 'the finger rested before its release');
});

test('a light that is released in motion is thrown', () => {
  const { recognizer, calls } = createRecognizer();
  recognizer.down(at(0, 0), ALL);
  for (let i = 1; i <= 5; i += 1) recognizer.move(at(20 * i, 0, 10 * i), ALL);
  calls();
  recognizer.up(at(100, 0, 55), ALL);
  assert.deepEqual(calls(), ['throw 2000 0']);
});

test('a mouse moves the light without a button, a finger does not', () => {
  const { recognizer, calls } = createRecognizer();
  recognizer.move(at(5, 6, 0, 'mouse'), ALL);
  recognizer.move(at(7, 8, 0, 'pen'), ALL);
  recognizer.move(at(9, 9), ALL);
  assert.deepEqual(calls(), ['light 5 6', 'light 7 8']);
  recognizer.move(at(5, 6, 0, 'mouse'), { ...ALL, movesLight: false });
  assert.deepEqual(calls(), []);
});

test('after a throw, the mouse takes the light again only after some distance', () => {
  const { recognizer, calls } = createRecognizer();
  recognizer.down(at(0, 0, 0, 'mouse'), ALL);
  for (let i = 1; i <= 5; i += 1) recognizer.move(at(20 * i, 0, 10 * i, 'mouse'), ALL);
  recognizer.up(at(100, 0, 55, 'mouse'), ALL);
  calls();
  recognizer.move(at(102, 0, 60, 'mouse'), ALL);
  assert.deepEqual(calls(), []);
  recognizer.move(at(110, 0, 70, 'mouse'), ALL);
  recognizer.move(at(111, 0, 80, 'mouse'), ALL);
  assert.deepEqual(calls(), ['light 110 0', 'light 111 0']);
});

test('two fingers zoom and pan, and restore the light', () => {
  const { recognizer, calls } = createRecognizer();
  recognizer.down(at(40, 50), ALL);
  recognizer.down(at(60, 50, 0, 'touch', 2), ALL);
  assert.deepEqual(calls(), ['light 40 50', 'restore']);
  recognizer.move(at(80, 50, 10, 'touch', 2), ALL);
  assert.deepEqual(calls(), ['pan 10 0', 'zoom 2 at 60 50']);
  recognizer.up(at(80, 50, 20, 'touch', 2), ALL);
  recognizer.move(at(0, 0, 30), ALL);
  recognizer.up(at(0, 0, 40), ALL);
  assert.deepEqual(calls(), [], 'the remaining finger of a pinch is ignored');
  recognizer.down(at(40, 50, 900), ALL);
  assert.deepEqual(calls(), ['light 40 50']);
});

test('without zoom a second finger changes nothing', () => {
  const { recognizer, calls } = createRecognizer();
  const light = { ...ALL, zooms: false };
  recognizer.down(at(40, 50), light);
  recognizer.down(at(60, 50, 0, 'touch', 2), light);
  recognizer.move(at(70, 50, 10, 'touch', 2), light);
  recognizer.move(at(45, 50, 20), light);
  assert.deepEqual(calls(), ['light 40 50', 'light 45 50']);
});

test('drags pan on request, and where no light can be moved', () => {
  const { recognizer, calls } = createRecognizer();
  recognizer.down(at(0, 0, 0, 'mouse'), ALL, true);
  recognizer.move(at(5, 3, 10, 'mouse'), ALL);
  recognizer.up(at(5, 3, 20, 'mouse'), ALL);
  assert.deepEqual(calls(), ['pan 5 3']);
  recognizer.down(at(0, 0), { ...ALL, movesLight: false });
  recognizer.move(at(20, 0, 10), { ...ALL, movesLight: false });
  recognizer.up(at(20, 0, 500), { ...ALL, movesLight: false });
  assert.deepEqual(calls(), ['pan 20 0']);
  recognizer.down(at(0, 0), { movesLight: false, zooms: true, isZoomed: false });
  recognizer.move(at(20, 0, 10), { movesLight: false, zooms: true, isZoomed: false });
  assert.deepEqual(calls(), []);
});

test('a picture that is released in motion glides on until it is pressed', () => {
  const { recognizer, calls, holds } = createRecognizer();
  recognizer.down(at(0, 0), ALL, true);
  for (let i = 1; i <= 5; i += 1) recognizer.move(at(0, -20 * i, 10 * i), ALL);
  calls();
  recognizer.up(at(0, -100, 55), ALL);
  assert.deepEqual(calls(), ['throw view 0 -2000']);
  assert.equal(holds(), 1);
  recognizer.down(at(0, 0, 100), ALL);
  assert.equal(holds(), 2);
  const whole = { ...ALL, movesLight: false, isZoomed: false };
  recognizer.cancel(1);
  recognizer.down(at(0, 0, 200), whole);
  recognizer.move(at(40, 0, 210), whole);
  recognizer.up(at(40, 0, 212), whole);
  assert.deepEqual(calls(), ['light 0 0'], 'the whole picture cannot be panned');
});

test('two quick taps at one place are a double tap', () => {
  const { recognizer, calls } = createRecognizer();
  const tap = (x: number, time: number, allowed = ALL) => {
    recognizer.down(at(x, 0, time), allowed);
    recognizer.up(at(x, 0, time + 50), allowed);
    return calls().filter((line) => line.startsWith('double'));
  };
  assert.deepEqual([tap(0, 0), tap(3, 200)], [[], ['double 3 0']]);
  assert.deepEqual(tap(3, 400), [], 'the third tap begins another double tap');
  assert.deepEqual(tap(3, 2000), []);
  assert.deepEqual(tap(60, 2100), [], 'too far away');
  const still = { ...ALL, zooms: false };
  assert.deepEqual([tap(0, 9000, still), tap(0, 9100, still)], [[], []]);
});

test('a cancelled pointer neither taps nor throws', () => {
  const { recognizer, calls } = createRecognizer();
  recognizer.down(at(0, 0), ALL);
  recognizer.cancel(1);
  recognizer.up(at(0, 0, 10), ALL);
  recognizer.down(at(0, 0, 20), ALL);
  recognizer.up(at(0, 0, 30), ALL);
  assert.deepEqual(calls(), ['light 0 0', 'light 0 0']);
  assert.equal(recognizer.isPressed, false);
});
