import assert from 'node:assert/strict';
import test from 'node:test';
import type { DecodedPhoto } from '../../engine/types.js';
import { headOf } from '../../photo/photograph.js';
import { WorkerPool } from './worker-pool.js';
import {
  crewOf,
  type FakeWorker,
  IMPATIENT,
  light,
  painted,
  photoOf,
  SHOWING,
  settle,
} from './worker-pool-fakes.js';

const SILENT = /does not answer/;

/** A place with a crew for a photograph, and all its tiles there. */
async function placed(pool: WorkerPool, photo: DecodedPhoto) {
  const session = await pool.open(headOf(photo));
  for (const index of session.tiles.flat()) {
    await session.put(index, photo.takeTile(index) as Uint8Array<ArrayBuffer>);
  }
  await session.plan();
  return session;
}

test('rows of tiles are shared out evenly, and together are the picture', async () => {
  for (const [tiles, size, shares] of [
    [16, 2, [8, 8]],
    [7, 3, [2, 3, 2]],
    [1, 4, [1]],
  ] as const) {
    const { pool, workers, alive } = crewOf(size);
    const { photo, has } = photoOf(tiles);
    const session = await placed(pool, photo);
    assert.equal(has.size, 0);
    assert.deepEqual(
      workers.map(({ held }) => [...held.values()][0]?.size),
      shares,
    );
    const all = Array.from({ length: tiles }, (_, i) => i);
    for (let frame = 0; frame < 3; frame += 1) {
      assert.deepEqual(painted(await session.relight(light, SHOWING)), all);
    }
    assert.equal((await session.take(0))[0], 0);
    session.end();
    assert.equal(await alive(), 0);
  }
});

test('the memory of a picture is used again', async () => {
  const { pool, workers } = crewOf(2);
  const session = await placed(pool, photoOf(4).photo);
  const [first] = await session.relight(light, SHOWING);
  assert.equal(first?.pixels.byteLength, 8);
  const before = first.pixels;
  await session.relight(light, SHOWING);
  assert.equal(before.byteLength, 0, 'it went back to the worker');
  assert.equal(workers[0]?.log.filter((kind) => kind === 'relight').length, 2);
});

test('a light is brought once, and again where tiles have come and gone', async () => {
  const { pool, workers } = crewOf(2);
  const { photo } = photoOf(4);
  const session = await placed(pool, photo);
  const brought: number[] = [];
  const counted = {
    ...light,
    linearRgb: (first: number, end: number) => {
      brought.push(first);
      return light.linearRgb(first, end);
    },
  };
  for (let frame = 0; frame < 3; frame += 1) await session.relight(counted, SHOWING);
  assert.equal(brought.length, 2, 'to each worker');
  assert.equal(workers[0]?.log.filter((kind) => kind === 'relight').length, 3);
  await session.put(0, await session.take(0));
  await session.plan();
  await session.relight(counted, SHOWING);
  await session.relight({ ...counted }, SHOWING);
  assert.equal(brought.length, 6);
});

test('photographs share the workers, which end with the last of them', async () => {
  const { pool, workers, alive } = crewOf(2);
  const [one, other] = await Promise.all([4, 6].map((tiles) => placed(pool, photoOf(tiles).photo)));
  assert.ok(one && other);
  assert.equal(workers.length, 2);
  // Both at once, of the same workers.
  const [four, six] = await Promise.all([
    one.relight(light, SHOWING),
    other.relight(light, SHOWING),
  ]);
  assert.equal(painted(four).length, 4);
  assert.equal(painted(six).length, 6);
  one.end();
  one.end();
  await settle();
  assert.equal(await alive(), 2);
  assert.ok(workers.every(({ held }) => held.size === 1));
  other.end();
  assert.equal(await alive(), 0);
  await placed(pool, photoOf(1).photo);
  assert.equal(workers.length, 3, 'others are started');
});

test('small photographs go to the workers with the least to do', async () => {
  const { pool, workers } = crewOf(2);
  const shifts = [];
  for (let i = 0; i < 4; i += 1) shifts.push(await placed(pool, photoOf(1).photo));
  assert.deepEqual(
    workers.map(({ held }) => held.size),
    [2, 2],
  );
  shifts[0]?.end();
  await placed(pool, photoOf(1).photo);
  assert.equal(workers[0]?.held.size, 2);
});

test('workers that do not start leave the photograph alone, and are not tried again', async () => {
  const refused = { pool: new WorkerPool(() => null, 2), workers: [], alive: () => 0 };
  const missing = crewOf(2, (worker) => worker.die());
  const broken = crewOf(2, (worker) => worker.say({ kind: 'broken', message: 'no module' }));
  for (const { pool, workers, alive } of [refused, missing, broken]) {
    const { photo, has } = photoOf(4);
    await assert.rejects(pool.open(headOf(photo)), { code: 'worker-unavailable' });
    assert.equal(has.size, 4);
    assert.equal(await alive(), 0);
    const started = workers.length;
    await assert.rejects(pool.open(headOf(photo)), { code: 'worker-unavailable' });
    assert.equal(workers.length, started);
  }
});

test('workers that take long to start are waited for longer than for work', async () => {
  const patience = { lookMs: 10, looks: 2, startLooks: 1000 };
  const { pool } = crewOf(2, (worker) => setTimeout(() => worker.start(), 100), patience);
  assert.equal((await pool.open(headOf(photoOf(4).photo))).size, 2);
});

test('workers that do not start in time are tried again for the next photograph', async () => {
  let starting = false;
  const { pool, alive } = crewOf(2, (worker) => starting && worker.start(), IMPATIENT);
  const { photo, has } = photoOf(4);
  await assert.rejects(pool.open(headOf(photo)), {
    code: 'worker-unavailable',
    message: /not answer/,
  });
  assert.deepEqual([has.size, await alive()], [4, 0]);
  starting = true;
  await placed(pool, photo);
  assert.equal(await alive(), 2);
});

for (const [how, stop, why] of [
  ['of which the browser tells', (worker: FakeWorker) => worker.die(), /out of memory/],
  [
    'that says so',
    (worker: FakeWorker) => worker.say({ kind: 'broken', message: 'unreachable' }),
    /unreachable/,
  ],
  ['silently', (worker: FakeWorker) => worker.terminate(), SILENT],
] as const) {
  test(`a worker that stops in the middle, ${how}, ends what it owes and no more`, async () => {
    const { pool, workers } = crewOf(2, undefined, why === SILENT ? IMPATIENT : undefined);
    const [whole, small] = [
      await placed(pool, photoOf(4).photo),
      await pool.open(headOf(photoOf(1).photo)),
    ];
    for (const worker of workers) worker.slow = true;
    const frames = Promise.all([
      assert.rejects(whole.relight(light, SHOWING), { code: 'worker-unavailable', message: why }),
      small.put(0, Uint8Array.of(0)),
    ]);
    stop(workers[1] as FakeWorker);
    workers[0]?.hurry();
    await frames;
    assert.match(whole.failure?.message ?? '', why);
    assert.equal(small.failure, null);
    await assert.rejects(whole.take(3), { code: 'worker-unavailable' });
    await small.plan();
    assert.deepEqual(painted(await small.relight(light, SHOWING)), [0]);
    whole.end();
    // Another takes its place.
    await placed(pool, photoOf(2).photo);
    assert.equal(workers.length, 3);
  });
}

test('a slow worker that answers now and then is not given up', async () => {
  const { pool, workers } = crewOf(1, undefined, { ...IMPATIENT, looks: 10 });
  const session = await placed(pool, photoOf(1).photo);
  const worker = workers[0] as FakeWorker;
  worker.slow = true;
  const frames = Promise.all([
    session.plan(),
    session.relight(light, SHOWING),
    session.relight(light, SHOWING),
  ]);
  for (let i = 0; i < 4; i += 1) {
    await new Promise((resolve) => setTimeout(resolve, 25));
    const request = worker.owed.shift();
    if (request) worker.answer(request);
  }
  await frames;
  // Nor one that owes nothing.
  await new Promise((resolve) => setTimeout(resolve, 60));
  assert.equal(session.failure, null);
});

/** Has all workers stop, one after the other. */
async function incident(pool: WorkerPool, alive: () => FakeWorker[], draw: boolean) {
  const session = await placed(pool, photoOf(4).photo);
  if (draw) await session.relight(light, SHOWING);
  for (const worker of await alive()) {
    worker.die();
    await settle();
  }
  assert.ok(session.failure);
  session.end();
}

test('workers that stop again and again before they have drawn are done without', async () => {
  const { pool, workers } = crewOf(4);
  const alive = () => workers.filter(({ ended }) => !ended);
  for (let i = 0; i < 3; i += 1) await incident(pool, alive, false);
  await assert.rejects(pool.open(headOf(photoOf(4).photo)), { code: 'worker-unavailable' });
  assert.equal(workers.length, 12);
});

test('workers that stop now and then are replaced, however often', async () => {
  const { pool, workers } = crewOf(4);
  const alive = () => workers.filter(({ ended }) => !ended);
  for (let i = 0; i < 5; i += 1) await incident(pool, alive, true);
  assert.equal((await placed(pool, photoOf(4).photo)).size, 4);
});

test('what cannot be sent fails, and nothing is owed for it', async () => {
  const { pool, workers } = crewOf(1, undefined, IMPATIENT);
  const session = await placed(pool, photoOf(1).photo);
  const bytes = Uint8Array.of(0);
  const unsent = Object.assign(new Error('no memory to send it'), { name: 'DataCloneError' });
  const worker = workers[0] as FakeWorker;
  worker.refusal = unsent;
  await assert.rejects(session.put(0, bytes), unsent);
  assert.equal(bytes.byteLength, 1);
  worker.refusal = null;
  await new Promise((resolve) => setTimeout(resolve, 100));
  assert.equal(session.failure, null, 'it is not taken for silent');
  await session.plan();
});

test('a photograph that is let go keeps nobody waiting, and others are served', async () => {
  const { pool, workers } = crewOf(1);
  const [gone, stays] = [
    await placed(pool, photoOf(2).photo),
    await placed(pool, photoOf(3).photo),
  ];
  const worker = workers[0] as FakeWorker;
  worker.slow = true;
  const frame = gone.relight(light, SHOWING);
  const other = stays.relight(light, SHOWING);
  gone.end();
  await assert.rejects(frame, { code: 'internal' });
  await assert.rejects(gone.take(0), { code: 'internal' });
  worker.hurry();
  assert.deepEqual(painted(await other), [0, 1, 2]);
  assert.equal(worker.held.size, 1);
});
