import assert from 'node:assert/strict';
import test from 'node:test';
import { Deferred } from '../shared/promises.js';
import { FrameBarrier } from './frame-barrier.js';

const settled = () => new Promise((resolve) => setTimeout(resolve));

test('all show their frame together, and those that fail or do not wait are not waited for', async () => {
  const barrier = new FrameBarrier(4);
  const shown: string[] = [];
  const computed = new Deferred();
  const first = barrier.pass(async (ready) => {
    await ready();
    shown.push('first');
  });
  const failed = barrier.pass(async () => {
    await computed.promise;
    throw new Error('lost');
  });
  failed.catch(() => {});
  barrier.pass(() => 'at once');
  await settled();
  assert.deepEqual(shown, []);
  assert.throws(() =>
    barrier.pass(() => {
      throw new Error('lost at once');
    }),
  );
  await settled();
  assert.deepEqual(shown, []);
  computed.resolve();
  await first;
  await assert.rejects(failed);
  assert.deepEqual(shown, ['first']);
});
