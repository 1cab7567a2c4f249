import assert from 'node:assert/strict';
import test from 'node:test';
import { type Key, keyAction } from './keys.js';

const PLAIN: Key = {
  key: '',
  code: '',
  shiftKey: false,
  ctrlKey: false,
  metaKey: false,
  altKey: false,
};

const press = (key: string, more: Partial<Key> = {}): Key => ({ ...PLAIN, key, ...more });

test('arrows move the light, with Shift a little, page keys a lot', () => {
  assert.deepEqual(keyAction(press('ArrowRight'), 'light'), { kind: 'move', dx: 0.05, dy: 0 });
  assert.deepEqual(keyAction(press('ArrowUp', { shiftKey: true }), 'light'), {
    kind: 'move',
    dx: 0,
    dy: -0.01,
  });
  assert.deepEqual(keyAction(press('PageDown'), 'light'), { kind: 'move', dx: 0, dy: 0.2 });
  assert.deepEqual(keyAction(press('Home'), 'light'), { kind: 'jump', x: 0 });
  assert.deepEqual(keyAction(press('End'), 'light'), { kind: 'jump', x: 1 });
  assert.deepEqual(keyAction(press('Escape'), 'light'), { kind: 'leave' });
});

test('letters pan by where they lie, arrows where there is no light to move', () => {
  assert.deepEqual(keyAction(press('z', { code: 'KeyW' }), 'light'), {
    kind: 'pan',
    dx: -0,
    dy: 0.15,
  });
  assert.equal(keyAction(press('ArrowLeft'), 'picture')?.kind, 'pan');
  assert.equal(keyAction(press('Home'), 'picture'), null);
});

test('zoom and lights are there from the controls too, whose own keys stay theirs', () => {
  for (const focus of ['light', 'picture', 'controls'] as const) {
    assert.deepEqual(keyAction(press('+'), focus), { kind: 'zoom', by: 1 });
    assert.deepEqual(keyAction(press('-'), focus), { kind: 'zoom', by: -1 });
    assert.deepEqual(keyAction(press('0'), focus), { kind: 'whole' });
    assert.deepEqual(keyAction(press('['), focus), { kind: 'light', by: -1 });
  }
  for (const key of ['ArrowLeft', 'Home', 'Escape', 'w', ' ', 'Tab']) {
    assert.equal(keyAction(press(key, { code: 'KeyW' }), 'controls'), null, key);
  }
});

test('the browser keeps its own keys', () => {
  assert.equal(keyAction(press('+', { ctrlKey: true }), 'light'), null);
  assert.equal(keyAction(press('[', { metaKey: true }), 'light'), null);
  assert.equal(keyAction(press('ArrowLeft', { altKey: true }), 'light'), null);
  const altGraph = press(']', { ctrlKey: true, altKey: true });
  assert.deepEqual(keyAction(altGraph, 'light'), { kind: 'light', by: 1 });
});
