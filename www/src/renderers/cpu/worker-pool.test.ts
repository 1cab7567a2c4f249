import assert from 'node:assert/strict';
import test from 'node:test';
import type { DecodedPhoto } from '../../engine/wasm-exports.js';
import { fakeLight, fakePhoto } from '../../photo/photograph-fakes.js';
import { describePhoto } from '../../photo/types.js';
import { WorkerPool } from './worker-pool.js';
import {
  type FakeWorker,
  FRAME,
  fakePool,
  SHORT_LIMITS,
  settle,
  tileIndices,
} from './worker-pool-fakes.js';

const SILENT = /does not answer/;

/** A session of a photograph with all its tiles in the workers. */
async function openWithTiles(pool: WorkerPool, photo: DecodedPhoto) {
  const session = await pool.open(describePhoto(photo));
  for (const index of session.tiles.flat()) {
    await session.put(index, photo.takeTile(index) as Uint8Array<ArrayBuffer>);
  }
  await session.plan();
  return session;
}

test('rows of tiles are split evenly, and together they are the picture', async () => {
  for (const [tileCount, size, tilesPerWorker] of [
    [16, 2, [8, 8]],
    [7, 3, [2, 3, 2]],
    [1, 4, [1]],
  ] as const) {
    const { pool, workers, countAlive } = fakePool(size);
    const { photo, tilesInModules } = fakePhoto(tileCount);
    const session = await openWithTiles(pool, photo);
    assert.equal(tilesInModules.size, 0);
    assert.deepEqual(
      workers.map(({ tiles }) => [...tiles.values()][0]?.size),
      tilesPerWorker,
    );
    const all = Array.from({ length: tileCount }, (_, i) => i);
    for (let frame = 0; frame < 3; frame += 1) {
      assert.deepEqual(tileIndices(await session.relight(fakeLight, FRAME)), all);
    }
    assert.equal((await session.take(0))[0], 0);
    session.end();
    assert.equal(await countAlive(), 0);
  }
});

test('the memory of a picture is reused', async () => {
  const { pool, workers } = fakePool(2);
  const session = await openWithTiles(pool, fakePhoto(4).photo);
  const [first] = await session.relight(fakeLight, FRAME);
  assert.equal(first?.pixels.byteLength, 8);
  const before = first.pixels;
  await session.relight(fakeLight, FRAME);
  assert.equal(before.byteLength, 0, 'it was transferred to the worker');
  assert.equal(workers[0]?.log.filter((kind) => kind === 'relight').length, 2);
});

test('a light is sent once, and again after tiles were moved', async () => {
  const { pool, workers } = fakePool(2);
  const session = await openWithTiles(pool, fakePhoto(4).photo);
  const sent: number[] = [];
  const counted = {
    ...fakeLight,
    linearRgb: (first: number, end: number) => {
      sent.push(first);
      return fakeLight.linearRgb(first, end);
    },
  };
  for (let frame = 0; frame < 3; frame += 1) await session.relight(counted, FRAME);
  assert.equal(sent.length, 2, 'to each worker');
  assert.equal(workers[0]?.log.filter((kind) => kind === 'relight').length, 3);
  await session.put(0, await session.take(0));
  await session.plan();
  await session.relight(counted, FRAME);
  await session.relight({ ...counted }, FRAME);
  assert.equal(sent.length, 6);
});

test('photographs share the workers, which end with the last photograph', async () => {
  const { pool, workers, countAlive } = fakePool(2);
  const [one, other] = await Promise.all(
    [4, 6].map((tileCount) => openWithTiles(pool, fakePhoto(tileCount).photo)),
  );
  assert.ok(one && other);
  assert.equal(workers.length, 2);
  const [four, six] = await Promise.all([
    one.relight(fakeLight, FRAME),
    other.relight(fakeLight, FRAME),
  ]);
  assert.equal(tileIndices(four).length, 4);
  assert.equal(tileIndices(six).length, 6);
  one.end();
  one.end();
  await settle();
  assert.equal(await countAlive(), 2);
  assert.ok(workers.every(({ tiles }) => tiles.size === 1));
  other.end();
  assert.equal(await countAlive(), 0);
  await openWithTiles(pool, fakePhoto(1).photo);
  assert.equal(workers.length, 3, 'a new one is started');
});

test('a small photograph goes to the worker with the fewest photographs', async () => {
  const { pool, workers } = fakePool(2);
  const sessions = [];
  for (let i = 0; i < 4; i += 1) sessions.push(await openWithTiles(pool, fakePhoto(1).photo));
  assert.deepEqual(
    workers.map(({ tiles }) => tiles.size),
    [2, 2],
  );
  sessions[0]?.end();
  await openWithTiles(pool, fakePhoto(1).photo);
  assert.equal(workers[0]?.tiles.size, 2);
});

test('workers that cannot start leave the photograph unchanged, and are not tried again', async () => {
  const forbidden = { pool: new WorkerPool(() => null, 2), workers: [], countAlive: () => 0 };
  const missing = fakePool(2, (worker) => worker.crash());
  const broken = fakePool(2, (worker) => worker.respond({ kind: 'failed', message: 'no module' }));
  for (const { pool, workers, countAlive } of [forbidden, missing, broken]) {
    const { photo, tilesInModules } = fakePhoto(4);
    await assert.rejects(pool.open(describePhoto(photo)), { code: 'worker-unavailable' });
    assert.equal(tilesInModules.size, 4);
    assert.equal(await countAlive(), 0);
    const started = workers.length;
    await assert.rejects(pool.open(describePhoto(photo)), { code: 'worker-unavailable' });
    assert.equal(workers.length, started);
  }
});

test('a start may take longer than a task', async () => {
  const limits = { intervalMs: 10, maxChecks: 2, maxStartChecks: 1000 };
  const { pool } = fakePool(2, (worker) => setTimeout(() => worker.start(), 100), limits);
  assert.equal((await pool.open(describePhoto(fakePhoto(4).photo))).size, 2);
});

test('workers that start too slowly are tried again for the next photograph', async () => {
  let isStarting = false;
  const { pool, countAlive } = fakePool(2, (worker) => isStarting && worker.start(), SHORT_LIMITS);
  const { photo, tilesInModules } = fakePhoto(4);
  await assert.rejects(pool.open(describePhoto(photo)), {
    code: 'worker-unavailable',
    message: SILENT,
  });
  assert.deepEqual([tilesInModules.size, await countAlive()], [4, 0]);
  isStarting = true;
  await openWithTiles(pool, photo);
  assert.equal(await countAlive(), 2);
});

for (const [how, stop, reason] of [
  ['and the browser reports it', (worker: FakeWorker) => worker.crash(), /out of memory/],
  [
    'and reports it itself',
    (worker: FakeWorker) => worker.respond({ kind: 'failed', message: 'unreachable' }),
    /unreachable/,
  ],
  ['silently', (worker: FakeWorker) => worker.terminate(), SILENT],
] as const) {
  test(`a worker that stops during a frame, ${how}, fails only its own photographs`, async () => {
    const { pool, workers } = fakePool(2, undefined, reason === SILENT ? SHORT_LIMITS : undefined);
    const [whole, small] = [
      await openWithTiles(pool, fakePhoto(4).photo),
      await pool.open(describePhoto(fakePhoto(1).photo)),
    ];
    for (const worker of workers) worker.isSlow = true;
    const frames = Promise.all([
      assert.rejects(whole.relight(fakeLight, FRAME), {
        code: 'worker-unavailable',
        message: reason,
      }),
      small.put(0, Uint8Array.of(0)),
    ]);
    stop(workers[1] as FakeWorker);
    workers[0]?.catchUp();
    await frames;
    assert.match(whole.failure?.message ?? '', reason);
    assert.equal(small.failure, null);
    await assert.rejects(whole.take(3), { code: 'worker-unavailable' });
    await small.plan();
    assert.deepEqual(tileIndices(await small.relight(fakeLight, FRAME)), [0]);
    whole.end();
    // A new worker takes its place.
    await openWithTiles(pool, fakePhoto(2).photo);
    assert.equal(workers.length, 3);
  });
}

test('a slow worker that answers from time to time is kept', async () => {
  const { pool, workers } = fakePool(1, undefined, { ...SHORT_LIMITS, maxChecks: 10 });
  const session = await openWithTiles(pool, fakePhoto(1).photo);
  const worker = workers[0] as FakeWorker;
  worker.isSlow = true;
  const frames = Promise.all([
    session.plan(),
    session.relight(fakeLight, FRAME),
    session.relight(fakeLight, FRAME),
  ]);
  for (let i = 0; i < 4; i += 1) {
    await new Promise((resolve) => setTimeout(resolve, 25));
    const request = worker.unanswered.shift();
    if (request) worker.answer(request);
  }
  await frames;
  // So is an idle one.
  await new Promise((resolve) => setTimeout(resolve, 60));
  assert.equal(session.failure, null);
});

/** All workers stop, one after the other. */
async function crashAll(pool: WorkerPool, workers: FakeWorker[], draw: boolean) {
  const session = await openWithTiles(pool, fakePhoto(4).photo);
  if (draw) await session.relight(fakeLight, FRAME);
  for (const worker of workers.filter(({ hasEnded }) => !hasEnded)) {
    worker.crash();
    await settle();
  }
  assert.ok(session.failure);
  session.end();
}

test('after three failures without a frame, the pool starts no more workers', async () => {
  const { pool, workers } = fakePool(4);
  for (let i = 0; i < 3; i += 1) await crashAll(pool, workers, false);
  await assert.rejects(pool.open(describePhoto(fakePhoto(4).photo)), {
    code: 'worker-unavailable',
  });
  assert.equal(workers.length, 12);
});

test('workers that have drawn a frame are replaced, however often they fail', async () => {
  const { pool, workers } = fakePool(4);
  for (let i = 0; i < 5; i += 1) await crashAll(pool, workers, true);
  assert.equal((await openWithTiles(pool, fakePhoto(4).photo)).size, 4);
});

test('a request that cannot be sent rejects, and no answer is expected', async () => {
  const { pool, workers } = fakePool(1, undefined, SHORT_LIMITS);
  const session = await openWithTiles(pool, fakePhoto(1).photo);
  const bytes = Uint8Array.of(0);
  const sendError = Object.assign(new Error('no memory to send it'), { name: 'DataCloneError' });
  const worker = workers[0] as FakeWorker;
  worker.sendError = sendError;
  await assert.rejects(session.put(0, bytes), sendError);
  assert.equal(bytes.byteLength, 1);
  worker.sendError = null;
  await new Promise((resolve) => setTimeout(resolve, 100));
  assert.equal(session.failure, null, 'the worker does not count as silent');
  await session.plan();
});

test('the end of a session rejects its requests, but not those of others', async () => {
  const { pool, workers } = fakePool(1);
  const [ended, other] = [
    await openWithTiles(pool, fakePhoto(2).photo),
    await openWithTiles(pool, fakePhoto(3).photo),
  ];
  const worker = workers[0] as FakeWorker;
  worker.isSlow = true;
  const frame = ended.relight(fakeLight, FRAME);
  const otherFrame = other.relight(fakeLight, FRAME);
  ended.end();
  await assert.rejects(frame, { code: 'internal' });
  await assert.rejects(ended.take(0), { code: 'internal' });
  worker.catchUp();
  assert.deepEqual(tileIndices(await otherFrame), [0, 1, 2]);
  assert.equal(worker.tiles.size, 1);
});
