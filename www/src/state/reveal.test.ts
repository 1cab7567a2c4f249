import assert from 'node:assert/strict';
import test from 'node:test';
import type { LoadingMode, RevealMode } from './attribute-parsers.js';
import { RevealState } from './reveal.js';

const options = (loading: LoadingMode, reveal: RevealMode = 'auto') => ({ loading, reveal });

test('a photograph is fetched at once or near the viewport', () => {
  const state = new RevealState();
  const mayFetch = () =>
    (['eager', 'lazy'] as const).map((loading) => state.mayFetch(options(loading)));
  assert.deepEqual(mayFetch(), [true, false]);
  state.isNear = true;
  assert.deepEqual(mayFetch(), [true, true]);
});

test('the poster gives way to the picture, after a press or a call where required', () => {
  const state = new RevealState();
  state.isNear = true;
  const isShown = () =>
    (['auto', 'interaction', 'manual'] as const).map((r) =>
      state.isPosterShown(options('eager', r)),
    );
  assert.deepEqual(isShown(), [true, true, true]);
  assert.equal(state.mayFetch(options('lazy', 'interaction')), false);
  assert.equal(state.mayFetch(options('eager', 'interaction')), false);
  assert.equal(state.mayFetch(options('lazy', 'manual')), true);
  assert.equal(state.needsPress(options('eager', 'interaction')), true);
  state.isDrawn = true;
  assert.deepEqual(isShown(), [false, true, true]);
  state.isDismissed = true;
  assert.deepEqual(isShown(), [false, false, false]);
  assert.equal(state.needsPress(options('eager', 'interaction')), false);
  state.isDrawn = false;
  assert.deepEqual(isShown(), [true, true, true], 'another photograph');
});
