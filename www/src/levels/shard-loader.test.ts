import assert from 'node:assert/strict';
import test from 'node:test';
import { Deferred } from '../shared/promises.js';
import { keyOf, type ShardId } from './level-table.js';
import { ShardLoader } from './shard-loader.js';

const shard = (x: number): ShardId => ({ level: 0, x, y: 0 });

/** A loader of two at a time whose loads wait until a test ends them; and those that were started. */
function createLoader() {
  const started: { key: string; signal: AbortSignal; end: Deferred }[] = [];
  const clock = { now: 0 };
  const load = (id: ShardId, signal: AbortSignal) => {
    const end = new Deferred();
    started.push({ key: keyOf(id), signal, end });
    signal.addEventListener('abort', () => end.reject(signal.reason));
    return end.promise;
  };
  return { started, clock, loader: new ShardLoader(load, () => clock.now, 2) };
}

const settled = () => new Promise((resolve) => setTimeout(resolve));
const keys = (loads: readonly { key: string }[]) => loads.map(({ key }) => key);

test('shards are loaded in order, two at a time', async () => {
  const { started, loader } = createLoader();
  loader.request([shard(2), shard(0), shard(1)]);
  assert.deepEqual(keys(started), ['0 2 0', '0 0 0']);
  started[1]?.end.resolve();
  await settled();
  assert.deepEqual(keys(started), ['0 2 0', '0 0 0', '0 1 0']);
});

test('what is needed no more is cancelled, and what is needed still goes on', async () => {
  const { started, loader } = createLoader();
  loader.request([shard(0), shard(1), shard(2)]);
  loader.request([shard(3), shard(1)]);
  await settled();
  assert.deepEqual(keys(started), ['0 0 0', '0 1 0', '0 3 0']);
  assert.deepEqual(
    started.map(({ signal }) => signal.aborted),
    [true, false, false],
  );
  // A load that was cancelled has not failed.
  loader.request([shard(0)]);
  await settled();
  assert.equal(started.at(-1)?.key, '0 0 0');
});

test('a shard that failed is tried again later', async () => {
  const { started, clock, loader } = createLoader();
  loader.request([shard(0)]);
  started[0]?.end.reject(new Error('offline'));
  await settled();
  loader.request([shard(0)]);
  assert.equal(started.length, 1);
  clock.now = 20_000;
  loader.request([shard(0)]);
  assert.equal(started.length, 2);
});

test('a shard that is needed again while its load is being cancelled is loaded again', async () => {
  const started: Deferred[] = [];
  const loader = new ShardLoader(
    () => {
      const end = new Deferred();
      started.push(end);
      return end.promise;
    },
    () => 0,
  );
  loader.request([shard(0)]);
  loader.request([]);
  loader.request([shard(0)]);
  assert.equal(started.length, 1, 'it has not ended yet');
  started[0]?.reject(new Error('cancelled'));
  await settled();
  assert.equal(started.length, 2);
});
