import assert from 'node:assert/strict';
import test from 'node:test';
import { LightState } from '../state/light-state.js';
import { createLoop } from './animation-fakes.js';
import { LightAnimator } from './light-animator.js';

function createAnimator(options: { name: 'fire' | 'torch' }) {
  const light = new LightState({
    changed: () => {},
    loaded: () => {},
    errorChanged: () => {},
  });
  light.setOptions({
    ...options,
    src: null,
    crossOrigin: null,
    torch: null,
    size: null,
    color: null,
  });
  const { loop, frame } = createLoop();
  let changes = 0;
  const animator = new LightAnimator(light, loop, () => {
    changes += 1;
  });
  return { light, animator, frame, changes: () => changes };
}

test('a fire has 30 frames a second at any refresh rate', () => {
  for (const rate of [30, 60, 75, 144]) {
    const { light, animator, frame, changes } = createAnimator({ name: 'fire' });
    const burning = { fire: true, wander: false };
    animator.update(burning);
    for (let i = 0; i <= rate; i += 1) {
      frame(1000 / rate);
      animator.update(burning);
    }
    assert.ok(Math.abs(changes() - 30) <= 1, `${changes()} at ${rate}`);
    assert.ok(Math.abs((light.setting.seconds ?? 0) - 1) <= 1 / 15);
    const before = changes();
    animator.update({ fire: false, wander: false });
    frame(500);
    assert.equal(changes(), before);
  }
});

test('a thrown torch glides to rest on the picture, unless it is stopped', () => {
  const { light, animator, frame } = createAnimator({ name: 'torch' });
  animator.throwTorch({ x: 1, y: 0 });
  for (let i = 0; i < 300; i += 1) frame(16);
  const at = light.torch;
  assert.ok(at && at.x > 0.7 && at.x < 0.8 && at.y === 0.5, JSON.stringify(at));
  animator.throwTorch({ x: 9, y: 9 });
  frame(16);
  frame(16);
  animator.stopTorch();
  const held = light.torch;
  frame(16);
  assert.deepEqual(light.torch, held);
  animator.throwTorch({ x: 9, y: 9 });
  for (let i = 0; i < 300; i += 1) frame(16);
  assert.deepEqual(light.torch, { x: 1, y: 1 });
});

test('a torch wanders until it is stopped', () => {
  const { light, animator, frame } = createAnimator({ name: 'torch' });
  animator.update({ fire: false, wander: true });
  for (let i = 0; i < 100; i += 1) frame(33);
  assert.notDeepEqual(light.torch, null);
  const at = light.torch;
  animator.update({ fire: false, wander: false });
  frame(33);
  assert.deepEqual(light.torch, at);
});
