import assert from 'node:assert/strict';
import test from 'node:test';
import { type KeyPress, keyAction } from './keys.js';

const PLAIN: KeyPress = {
  key: '',
  code: '',
  shiftKey: false,
  ctrlKey: false,
  metaKey: false,
  altKey: false,
};

const press = (key: string, more: Partial<KeyPress> = {}): KeyPress => ({ ...PLAIN, key, ...more });

test('arrows move the light; Shift makes small steps, page keys large ones', () => {
  assert.deepEqual(keyAction(press('ArrowRight'), 'light'), {
    kind: 'move-light',
    dx: 0.05,
    dy: 0,
  });
  assert.deepEqual(keyAction(press('ArrowUp', { shiftKey: true }), 'light'), {
    kind: 'move-light',
    dx: 0,
    dy: -0.01,
  });
  assert.deepEqual(keyAction(press('PageDown'), 'light'), { kind: 'move-light', dx: 0, dy: 0.2 });
  assert.deepEqual(keyAction(press('Home'), 'light'), { kind: 'move-light', dx: -1, dy: 0 });
  assert.deepEqual(keyAction(press('End'), 'light'), { kind: 'move-light', dx: 1, dy: 0 });
  assert.deepEqual(keyAction(press('Escape'), 'light'), { kind: 'escape' });
});

test('W, A, S and D pan by their position on the keyboard, and arrows if no light can be moved', () => {
  assert.deepEqual(keyAction(press('z', { code: 'KeyW' }), 'light'), {
    kind: 'pan',
    dx: -0,
    dy: 0.15,
  });
  assert.equal(keyAction(press('ArrowLeft'), 'picture')?.kind, 'pan');
  assert.equal(keyAction(press('Home'), 'picture'), null);
});

test('zoom keys and light keys work in the controls, which keep their own keys', () => {
  for (const focus of ['light', 'picture', 'controls'] as const) {
    assert.deepEqual(keyAction(press('+'), focus), { kind: 'zoom', by: 1 });
    assert.deepEqual(keyAction(press('-'), focus), { kind: 'zoom', by: -1 });
    assert.deepEqual(keyAction(press('0'), focus), { kind: 'reset-view' });
    assert.deepEqual(keyAction(press('['), focus), { kind: 'select-light', by: -1 });
  }
  for (const key of ['ArrowLeft', 'Home', 'Escape', 'w', ' ', 'Tab']) {
    assert.equal(keyAction(press(key, { code: 'KeyW' }), 'controls'), null, key);
  }
});

test('shortcuts of the browser are left alone', () => {
  assert.equal(keyAction(press('+', { ctrlKey: true }), 'light'), null);
  assert.equal(keyAction(press('[', { metaKey: true }), 'light'), null);
  assert.equal(keyAction(press('ArrowLeft', { altKey: true }), 'light'), null);
  const altGraph = press(']', { ctrlKey: true, altKey: true });
  assert.deepEqual(keyAction(altGraph, 'light'), { kind: 'select-light', by: 1 });
});
