import assert from 'node:assert/strict';
import test from 'node:test';
import { LoadQueue, OUT_OF_VIEW, type QueuedLoad } from './load-queue.js';

const STALL_MS = 20;

const pass = (ms = 5) => new Promise((resolve) => setTimeout(resolve, ms));

/** Loads whose ends a test controls; `started` has their names in order. */
function fakeLoads() {
  const queue = new LoadQueue(STALL_MS);
  const started: string[] = [];
  const create = (name: string, placement: number, mayStart = () => true) => {
    let end = (): void => {};
    let setWaiting = (_: boolean): void => {};
    const load: QueuedLoad = {
      placement,
      mayStart,
      run: (report) => {
        started.push(name);
        setWaiting = report;
        return new Promise((resolve) => {
          end = resolve;
        });
      },
    };
    queue.add(load);
    return {
      load,
      setWaiting: (isWaiting: boolean) => setWaiting(isWaiting),
      end: async () => {
        end();
        await pass();
      },
    };
  };
  return { queue, started, create };
}

test('loads run one after another, the nearest first and those out of view last', async () => {
  const { started, create } = fakeLoads();
  const loads = {
    below: create('below', OUT_OF_VIEW + 100),
    corner: create('corner', 500),
    middle: create('middle', 0),
  };
  await pass();
  assert.deepEqual(started, ['middle']);
  await loads.middle.end();
  assert.deepEqual(started, ['middle', 'corner']);
  await loads.corner.end();
  await loads.below.end();
  assert.deepEqual(started, ['middle', 'corner', 'below']);
});

test('a load whose request ends after it has failed holds up no other', async () => {
  const { started, create } = fakeLoads();
  const failed = create('failed', 0);
  const next = create('next', 1);
  await pass();
  await failed.end();
  failed.setWaiting(false);
  create('last', 2);
  await pass();
  assert.deepEqual(started, ['failed', 'next']);
  await next.end();
  assert.deepEqual(started, ['failed', 'next', 'last']);
});

test('a load that is removed does not run, and one that may not start is passed over', async () => {
  const { queue, started, create } = fakeLoads();
  let hasRoom = false;
  create('first', 0, () => hasRoom);
  const { load } = create('removed', 1);
  queue.remove(load);
  const second = create('second', 2);
  await pass();
  assert.deepEqual(started, ['second']);
  await second.end();
  hasRoom = true;
  queue.schedule();
  await pass();
  assert.deepEqual(started, ['second', 'first']);
});

test('a load that waits for the network lets others run until it goes on', async () => {
  const { started, create } = fakeLoads();
  const slow = create('slow', 0);
  await pass();
  slow.setWaiting(true);
  slow.setWaiting(false);
  const next = create('next', 1);
  await pass(3 * STALL_MS);
  assert.deepEqual(started, ['slow'], 'it decodes');
  slow.setWaiting(true);
  await pass(3 * STALL_MS);
  assert.deepEqual(started, ['slow', 'next']);
  slow.setWaiting(false);
  create('last', 2);
  await next.end();
  assert.deepEqual(started, ['slow', 'next'], 'the first has gone on');
  await slow.end();
  assert.deepEqual(started, ['slow', 'next', 'last']);
});
