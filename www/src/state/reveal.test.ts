import assert from 'node:assert/strict';
import test from 'node:test';
import type { LoadingMode, RevealMode } from './attribute-parsers.js';
import { RevealState } from './reveal.js';

const options = (loading: LoadingMode, reveal: RevealMode = 'auto') => ({ loading, reveal });

test('a photograph is fetched at once, near the viewport, or in the viewport', () => {
  const state = new RevealState();
  const mayFetch = () =>
    (['eager', 'auto', 'lazy'] as const).map((loading) => state.mayFetch(options(loading)));
  assert.deepEqual(mayFetch(), [true, false, false]);
  state.isNear = true;
  assert.deepEqual(mayFetch(), [true, true, false]);
  state.isVisible = true;
  assert.deepEqual(mayFetch(), [true, true, true]);
});

test('the poster gives way to the picture, after a press or a call where required', () => {
  const state = new RevealState();
  state.isNear = true;
  const isShown = () =>
    (['auto', 'interaction', 'manual'] as const).map((r) =>
      state.isPosterShown(options('auto', r)),
    );
  assert.deepEqual(isShown(), [true, true, true]);
  assert.equal(state.mayFetch(options('auto', 'interaction')), false);
  assert.equal(state.mayFetch(options('eager', 'interaction')), true);
  assert.equal(state.mayFetch(options('auto', 'manual')), true);
  assert.equal(state.needsPress(options('auto', 'interaction')), true);
  state.isDrawn = true;
  assert.deepEqual(isShown(), [false, true, true]);
  state.isDismissed = true;
  assert.deepEqual(isShown(), [false, false, false]);
  assert.equal(state.needsPress(options('auto', 'interaction')), false);
  state.isDrawn = false;
  assert.deepEqual(isShown(), [true, true, true], 'another photograph');
});
