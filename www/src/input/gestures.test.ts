import assert from 'node:assert/strict';
import test from 'node:test';
import { type Allowed, Gestures, type Pointer } from './gestures.js';

const ALL: Allowed = { light: true, zoom: true, zoomed: true };

/** Gestures, and what they told since it was last asked. */
function gestures() {
  const log: string[] = [];
  const round = (...values: number[]) => values.map((value) => Math.round(100 * value) / 100);
  const it = new Gestures({
    light: (x, y) => log.push(`light ${x} ${y}`),
    undoLight: () => log.push('undo'),
    throwLight: ({ x, y }) => log.push(`throw ${round(x, y).join(' ')}`),
    pan: (dx, dy) => log.push(`pan ${dx} ${dy}`),
    zoom: (factor, x, y) => log.push(`zoom ${round(factor).join()} at ${x} ${y}`),
    tapTwice: (x, y) => log.push(`twice ${x} ${y}`),
  });
  return { it, told: () => log.splice(0) };
}

function at(x: number, y: number, time = 0, kind: Pointer['kind'] = 'touch', id = 1): Pointer {
  return { id, kind, x, y, time };
}

test('a finger takes the light along', () => {
  const { it, told } = gestures();
  it.down(at(10, 20), ALL);
  it.move(at(30, 20, 10), ALL);
  assert.deepEqual(told(), ['light 10 20', 'light 30 20']);
  it.up(at(30, 20, 500), ALL);
  assert.deepEqual(told(), [], 'held still, so not thrown');
});

test('a light that is let go in motion is thrown', () => {
  const { it, told } = gestures();
  it.down(at(0, 0), ALL);
  for (let i = 1; i <= 5; i += 1) it.move(at(20 * i, 0, 10 * i), ALL);
  told();
  it.up(at(100, 0, 55), ALL);
  assert.deepEqual(told(), ['throw 2000 0']);
});

test('a mouse moves the light without a button, a finger does not', () => {
  const { it, told } = gestures();
  it.move(at(5, 6, 0, 'mouse'), ALL);
  it.move(at(7, 8, 0, 'pen'), ALL);
  it.move(at(9, 9), ALL);
  assert.deepEqual(told(), ['light 5 6', 'light 7 8']);
  it.move(at(5, 6, 0, 'mouse'), { ...ALL, light: false });
  assert.deepEqual(told(), []);
});

test('a mouse that threw the light takes it up again only where it means to', () => {
  const { it, told } = gestures();
  it.down(at(0, 0, 0, 'mouse'), ALL);
  for (let i = 1; i <= 5; i += 1) it.move(at(20 * i, 0, 10 * i, 'mouse'), ALL);
  it.up(at(100, 0, 55, 'mouse'), ALL);
  told();
  it.move(at(102, 0, 60, 'mouse'), ALL);
  assert.deepEqual(told(), []);
  it.move(at(110, 0, 70, 'mouse'), ALL);
  it.move(at(111, 0, 80, 'mouse'), ALL);
  assert.deepEqual(told(), ['light 110 0', 'light 111 0']);
});

test('two fingers zoom and pan, and put the light back', () => {
  const { it, told } = gestures();
  it.down(at(40, 50), ALL);
  it.down(at(60, 50, 0, 'touch', 2), ALL);
  assert.deepEqual(told(), ['light 40 50', 'undo']);
  it.move(at(80, 50, 10, 'touch', 2), ALL);
  assert.deepEqual(told(), ['pan 10 0', 'zoom 2 at 60 50']);
  it.up(at(80, 50, 20, 'touch', 2), ALL);
  it.move(at(0, 0, 30), ALL);
  it.up(at(0, 0, 40), ALL);
  assert.deepEqual(told(), [], 'what is left of a pinch does nothing');
  it.down(at(40, 50, 900), ALL);
  assert.deepEqual(told(), ['light 40 50']);
});

test('without zoom a second finger changes nothing', () => {
  const { it, told } = gestures();
  const light = { ...ALL, zoom: false };
  it.down(at(40, 50), light);
  it.down(at(60, 50, 0, 'touch', 2), light);
  it.move(at(70, 50, 10, 'touch', 2), light);
  it.move(at(45, 50, 20), light);
  assert.deepEqual(told(), ['light 40 50', 'light 45 50']);
});

test('drags pan where that is asked for, and where no light is to be moved', () => {
  const { it, told } = gestures();
  it.down(at(0, 0, 0, 'mouse'), ALL, true);
  it.move(at(5, 3, 10, 'mouse'), ALL);
  it.up(at(5, 3, 20, 'mouse'), ALL);
  assert.deepEqual(told(), ['pan 5 3']);
  it.down(at(0, 0), { ...ALL, light: false });
  it.move(at(20, 0, 10), { ...ALL, light: false });
  it.up(at(20, 0, 11), { ...ALL, light: false });
  assert.deepEqual(told(), ['pan 20 0']);
  it.down(at(0, 0), { light: false, zoom: true, zoomed: false });
  it.move(at(20, 0, 10), { light: false, zoom: true, zoomed: false });
  assert.deepEqual(told(), []);
});

test('two taps at one place are one gesture, if they come soon', () => {
  const { it, told } = gestures();
  const tap = (x: number, time: number, allowed = ALL) => {
    it.down(at(x, 0, time), allowed);
    it.up(at(x, 0, time + 50), allowed);
    return told().filter((line) => line.startsWith('twice'));
  };
  assert.deepEqual([tap(0, 0), tap(3, 200)], [[], ['twice 3 0']]);
  assert.deepEqual(tap(3, 400), [], 'the third is the first of the next');
  assert.deepEqual(tap(3, 2000), []);
  assert.deepEqual(tap(60, 2100), [], 'elsewhere');
  const still = { ...ALL, zoom: false };
  assert.deepEqual([tap(0, 9000, still), tap(0, 9100, still)], [[], []]);
});

test('what the browser takes for its own is no tap and no throw', () => {
  const { it, told } = gestures();
  it.down(at(0, 0), ALL);
  it.cancel(1);
  it.up(at(0, 0, 10), ALL);
  it.down(at(0, 0, 20), ALL);
  it.up(at(0, 0, 30), ALL);
  assert.deepEqual(told(), ['light 0 0', 'light 0 0']);
  assert.equal(it.holds, false);
});
