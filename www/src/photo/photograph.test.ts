import assert from 'node:assert/strict';
import test from 'node:test';
import type { RelightModule } from '../engine/wasm-exports.js';
import { WorkerPool } from '../renderers/cpu/worker-pool.js';
import {
  type FakeWorker,
  FRAME,
  fakePool,
  settle,
  tileIndices,
} from '../renderers/cpu/worker-pool-fakes.js';
import { LoadedPhotograph } from './photograph.js';
import { fakeLight, fakePhoto } from './photograph-fakes.js';
import { describePhoto, type TransferredTile } from './types.js';

const ALL = [0, 1, 2, 3];

/** A photograph of four tiles from a worker. */
function fromWorker() {
  const { photo, tilesInModules, state, module } = fakePhoto(4);
  const tiles = ALL.map((index) => photo.takeTile(index) as TransferredTile);
  const descriptor = describePhoto(photo);
  photo.free();
  return { photograph: new LoadedPhotograph(descriptor, tiles), tilesInModules, state, module };
}

async function relight(photograph: LoadedPhotograph, pool: WorkerPool): Promise<number[]> {
  return photograph.withWorkers(pool, async (session) =>
    tileIndices(await session.relight(fakeLight, FRAME)),
  );
}

test('tiles move to the workers, and to a module of the page when it needs them', async () => {
  const { pool, countAlive } = fakePool(2);
  const { photograph, tilesInModules, module } = fromWorker();
  assert.deepEqual(await relight(photograph, pool), ALL);
  assert.equal(tilesInModules.size, 0);
  assert.equal(await photograph.withModule(module, () => tilesInModules.size), 4);
  assert.equal(await countAlive(), 0, 'workers without a photograph end');
  assert.deepEqual(await relight(photograph, pool), ALL);
  assert.equal(tilesInModules.size, 0);
  assert.equal(photograph.info.decodedBytes, 4);
});

test('uses of a photograph run in the order of the calls', async () => {
  const { pool } = fakePool(2);
  const { photo, tilesInModules, module } = fakePhoto(4);
  const photograph = LoadedPhotograph.fromModule(photo);
  const order: string[] = [];
  const note = (what: string) => () => {
    order.push(`${what} ${tilesInModules.size}`);
  };
  await Promise.all([
    relight(photograph, pool).then(note('picture')),
    photograph.withModule(module, note('page')),
    relight(photograph, pool).then(note('picture')),
    relight(photograph, pool).then(note('picture')),
    photograph.withModule(module, note('page')),
  ]);
  const steps = order.map((step) => step.split(' ')[0]);
  assert.deepEqual(steps, ['picture', 'page', 'picture', 'picture', 'page']);
  assert.deepEqual(
    order.filter((step) => step.startsWith('page')),
    ['page 4', 'page 4'],
  );
});

test('a failed use does not affect the next one', async () => {
  const { photograph, tilesInModules, module } = fromWorker();
  const failing = photograph.withModule(module, () => Promise.reject(new Error('no adapter')));
  const next = photograph.withModule(module, () => tilesInModules.size);
  await assert.rejects(failing, /no adapter/);
  assert.equal(await next, 4);
});

test('without workers the tiles stay', async () => {
  const { photograph, tilesInModules, module } = fromWorker();
  const pool = new WorkerPool(() => null, 2);
  await assert.rejects(relight(photograph, pool), { code: 'worker-unavailable' });
  assert.equal(await photograph.withModule(module, () => tilesInModules.size), 4);
});

/** A worker crashes before `use`, or during it. */
async function crashDuring(
  use: (photograph: LoadedPhotograph, pool: WorkerPool, module: RelightModule) => Promise<unknown>,
  isIdle: boolean,
) {
  const { pool, workers } = fakePool(2);
  const { photograph, state, module } = fromWorker();
  await relight(photograph, pool);
  const worker = workers[1] as FakeWorker;
  if (isIdle) worker.crash();
  else worker.isSlow = true;
  const using = assert.rejects(use(photograph, pool, module), {
    code: 'photo-lost',
    message: /out of memory/,
  });
  await settle();
  if (!isIdle) worker.crash();
  await using;
  // The photograph stays unusable.
  await assert.rejects(
    photograph.withModule(module, () => {}),
    { code: 'photo-lost' },
  );
  await assert.rejects(relight(photograph, pool), { code: 'photo-lost' });
  await settle();
  assert.ok(workers.every(({ hasEnded }) => hasEnded));
  photograph.free();
  await settle();
  assert.equal(state.alive, 0);
}

for (const isIdle of [true, false]) {
  const when = isIdle ? 'before' : 'during';
  test(`a worker that crashes ${when} relighting loses the photograph`, () =>
    crashDuring(relight, isIdle));
  test(`a worker that crashes ${when} the return of tiles loses the photograph`, () =>
    crashDuring((photograph, _, module) => photograph.withModule(module, () => {}), isIdle));
}

test('a worker that crashes while it receives tiles loses the photograph', async () => {
  const { pool } = fakePool(1, (worker) => {
    worker.start();
    const answer = worker.answer.bind(worker);
    worker.answer = (request) => {
      const { task } = request.task;
      if (task.kind !== 'put' || task.index !== 2) answer(request);
      else setImmediate(() => worker.crash());
    };
  });
  const { photograph, module } = fromWorker();
  await assert.rejects(relight(photograph, pool), { code: 'photo-lost' });
  await assert.rejects(
    photograph.withModule(module, () => {}),
    { code: 'photo-lost' },
  );
});

test('tiles that cannot be sent are not lost, even if the worker crashes afterwards', async () => {
  const { pool, workers } = fakePool(1, (worker) => {
    worker.start();
    if (workers.length === 1) worker.sendError = new Error('no memory to send it');
  });
  const { photograph } = fromWorker();
  await assert.rejects(relight(photograph, pool), /no memory/);
  workers[0]?.crash();
  await assert.rejects(relight(photograph, pool), { code: 'worker-unavailable' });
  assert.deepEqual(await relight(photograph, pool), ALL);
  assert.equal(workers.length, 2);
});

test('a worker that crashes while another one starts loses no tiles', async () => {
  const { pool, workers } = fakePool(2, () => {});
  const { photograph, tilesInModules, module } = fromWorker();
  const frame = assert.rejects(relight(photograph, pool), { code: 'worker-unavailable' });
  await settle();
  workers[0]?.start();
  await settle();
  workers[0]?.crash();
  workers[1]?.start();
  await frame;
  assert.equal(await photograph.withModule(module, () => tilesInModules.size), 4);
});

test('a tile for which the module tilesInModules no memory is not lost', async () => {
  const { pool } = fakePool(2);
  const { photo, tilesInModules, state, module } = fakePhoto(4);
  const photograph = LoadedPhotograph.fromModule(photo);
  await relight(photograph, pool);
  state.isOutOfMemory = true;
  await assert.rejects(
    photograph.withModule(module, () => {}),
    { code: 'format-limit' },
  );
  state.isOutOfMemory = false;
  assert.deepEqual(await relight(photograph, pool), ALL);
  assert.equal(await photograph.withModule(module, () => tilesInModules.size), 4);
});

test('freeing a photograph rejects pending uses, and frees its memory after the one in progress', async () => {
  const { pool, workers, countAlive } = fakePool(2);
  const { photograph, state, module } = fromWorker();
  await relight(photograph, pool);
  for (const worker of workers) worker.isSlow = true;
  const frame = assert.rejects(relight(photograph, pool), { code: 'internal' });
  const next = assert.rejects(
    photograph.withModule(module, () => {}),
    { code: 'internal' },
  );
  await settle();
  photograph.free();
  await frame;
  await next;
  await settle();
  assert.deepEqual([state.alive, await countAlive()], [0, 0]);
});

test('a photograph that is freed while workers start sends them no tiles', async () => {
  const { pool, workers, countAlive } = fakePool(2, () => {});
  const { photograph, state } = fromWorker();
  const frame = assert.rejects(relight(photograph, pool), { code: 'internal' });
  await settle();
  assert.equal(await countAlive(), 2);
  photograph.free();
  await settle();
  for (const worker of workers) worker.start();
  await frame;
  await settle();
  assert.deepEqual([state.alive, await countAlive()], [0, 0]);
  assert.ok(workers.every(({ log }) => !log.includes('put')));
});

test('before tiles leave a module, its users are told', async () => {
  const { photo, tilesInModules, state, module } = fakePhoto(4);
  const photograph = LoadedPhotograph.fromModule(photo);
  const calls: string[] = [];
  const onLeave = () => calls.push(`${tilesInModules.size} to leave`);
  await photograph.withModule(module, () => {}, { onLeave });
  assert.deepEqual([tilesInModules.size, state.alive, calls], [4, 1, []]);
  await photograph.withModule({ ...module }, () => {});
  assert.deepEqual([tilesInModules.size, state.alive, calls], [4, 1, ['4 to leave']]);
  const { pool } = fakePool(2);
  assert.deepEqual(await relight(photograph, pool), ALL);
  assert.deepEqual([tilesInModules.size, state.alive, calls], [0, 0, ['4 to leave']]);
});

test('a module without memory leaves the tiles where they are', async () => {
  const { photo, tilesInModules, state, module } = fakePhoto(4);
  const photograph = LoadedPhotograph.fromModule(photo);
  state.isOutOfMemory = true;
  await assert.rejects(
    photograph.withModule(module, () => {}),
    { code: 'format-limit' },
  );
  state.isOutOfMemory = false;
  assert.equal(await photograph.withModule({ ...module }, () => tilesInModules.size), 4);
  assert.equal(state.alive, 1);
  photograph.free();
  await settle();
  assert.equal(state.alive, 0);
});

test('the metadata has the colour matrix', () => {
  const { photo } = fakePhoto(1);
  assert.deepEqual(LoadedPhotograph.fromModule(photo).colorMatrix[1], [0, 1, 0]);
  const metadata = '{"color_matrix": [[1.9, -0.7, -0.2], [-0.2, 1.5, -0.3], [0, -0.6, 1.6]]}';
  const { colorMatrix } = LoadedPhotograph.fromModule({ ...fakePhoto(1).photo, metadata });
  assert.deepEqual(colorMatrix[2], [0, -0.6, 1.6]);
});

test('metadata of another form is format-invalid, and the photograph is freed', () => {
  const wrongMatrices = ['null', '[]', '[1, 1, 1]', '[[1, 0, 0], [0, 1, 0], [0, 0, 1001]]'];
  const withMatrices = wrongMatrices.map((matrix) => `{"color_matrix": ${matrix}}`);
  for (const metadata of ['[]', '', '1', '{"a": }', 'null', ...withMatrices]) {
    const { photo, state } = fakePhoto(1);
    const wrong = { ...photo, metadata };
    assert.throws(() => LoadedPhotograph.fromModule(wrong), { code: 'format-invalid' });
    assert.equal(state.alive, 0);
  }
});
