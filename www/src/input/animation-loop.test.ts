import assert from 'node:assert/strict';
import test from 'node:test';
import { Lighting } from '../state/lighting.js';
import { Frames } from './animation-loop.js';
import { Movement } from './light-animator.js';

function clock() {
  let now = 0;
  const asked: ((ms: number) => void)[] = [];
  const frames = new Frames((callback) => asked.push(callback));
  const frame = (ms: number) => {
    now += ms;
    for (const callback of asked.splice(0)) callback(now);
  };
  return { frames, frame, asked };
}

test('what goes on is told how much time went by, until it ends', () => {
  const { frames, frame, asked } = clock();
  const times: number[] = [];
  frames.set('a', (seconds) => times.push(seconds) < 3);
  for (let i = 0; i < 9; i += 1) frame(20);
  assert.deepEqual(times, [0, 0.02, 0.02]);
  assert.equal(asked.length, 0, 'nothing is asked for nothing');
});

test('while nobody looks all stands still, and then goes on where it was', () => {
  const { frames, frame, asked } = clock();
  const times: number[] = [];
  frames.set('a', (seconds) => times.push(seconds) > 0);
  frame(20);
  frames.allow(false);
  frame(20);
  assert.equal(asked.length, 0);
  frame(60_000);
  frames.allow(true);
  frame(20);
  frame(20);
  assert.deepEqual(times, [0, 0, 0.02]);
});

function moving(asked: { name: 'fire' | 'torch' }) {
  const lighting = new Lighting({ changed: () => {}, came: () => {}, errorChanged: () => {} });
  lighting.ask({ ...asked, src: null, place: null, size: null, color: null }, null);
  const { frames, frame } = clock();
  let changes = 0;
  const movement = new Movement(lighting, frames, () => {
    changes += 1;
  });
  return { lighting, movement, frame, changes: () => changes };
}

test('fire looks different 30 times a second, however often the screen does', () => {
  for (const rate of [30, 60, 75, 144]) {
    const { lighting, movement, frame, changes } = moving({ name: 'fire' });
    const burning = { fire: true, breath: false };
    movement.update(burning);
    for (let i = 0; i <= rate; i += 1) {
      frame(1000 / rate);
      movement.update(burning);
    }
    assert.ok(Math.abs(changes() - 30) <= 1, `${changes()} at ${rate}`);
    assert.ok(Math.abs((lighting.setting.seconds ?? 0) - 1) <= 1 / 15);
    const before = changes();
    movement.update({ fire: false, breath: false });
    frame(500);
    assert.equal(changes(), before);
  }
});

test('a torch that is thrown glides to rest on the picture, unless it is held', () => {
  const { lighting, movement, frame } = moving({ name: 'torch' });
  movement.throw({ x: 1, y: 0 });
  for (let i = 0; i < 300; i += 1) frame(16);
  const at = lighting.torch;
  assert.ok(at && at.x > 0.7 && at.x < 0.8 && at.y === 0.5, JSON.stringify(at));
  movement.throw({ x: 9, y: 9 });
  frame(16);
  frame(16);
  movement.hold();
  const held = lighting.torch;
  frame(16);
  assert.deepEqual(lighting.torch, held);
  movement.throw({ x: 9, y: 9 });
  for (let i = 0; i < 300; i += 1) frame(16);
  assert.deepEqual(lighting.torch, { x: 1, y: 1 });
});

test('a torch wanders by itself, and no other light does', () => {
  const { lighting, movement, frame } = moving({ name: 'torch' });
  movement.update({ fire: false, breath: true });
  for (let i = 0; i < 100; i += 1) frame(33);
  assert.notDeepEqual(lighting.torch, null);
  const at = lighting.torch;
  movement.update({ fire: false, breath: false });
  frame(33);
  assert.deepEqual(lighting.torch, at);
});
