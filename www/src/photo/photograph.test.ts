import assert from 'node:assert/strict';
import test from 'node:test';
import type { DrawingModule } from '../engine/types.js';
import { WorkerPool } from '../renderers/cpu/worker-pool.js';
import {
  crewOf,
  type FakeWorker,
  light,
  painted,
  photoOf,
  SHOWING,
  settle,
} from '../renderers/cpu/worker-pool-fakes.js';
import { headOf, Photograph, type TileBytes } from './photograph.js';

const ALL = [0, 1, 2, 3];

/** One of four tiles, as a worker gave them. */
function received() {
  const { photo, has, state, module } = photoOf(4);
  const tiles = ALL.map((index) => photo.takeTile(index) as TileBytes);
  const head = headOf(photo);
  photo.free();
  return { photograph: Photograph.received(head, tiles), has, state, module };
}

async function picture(photograph: Photograph, pool: WorkerPool): Promise<number[]> {
  return photograph.withWorkers(pool, async (session) =>
    painted(await session.relight(light, SHOWING)),
  );
}

test('tiles go straight to the pool, and back into the page’s module when they are renderOptions there', async () => {
  const { pool, alive } = crewOf(2);
  const { photograph, has, module } = received();
  assert.deepEqual(await picture(photograph, pool), ALL);
  assert.equal(has.size, 0);
  assert.equal(await photograph.withModule(module, () => has.size), 4);
  assert.equal(await alive(), 0, 'workers without a photograph end');
  assert.deepEqual(await picture(photograph, pool), ALL);
  assert.equal(has.size, 0);
  assert.equal(photograph.info.decodedBytes, 4);
});

test('what is asked for is done in order, whatever takes long', async () => {
  const { pool } = crewOf(2);
  const { photo, has, module } = photoOf(4);
  const photograph = Photograph.decoded(photo);
  const order: string[] = [];
  const note = (what: string) => () => {
    order.push(`${what} ${has.size}`);
  };
  await Promise.all([
    picture(photograph, pool).then(note('picture')),
    photograph.withModule(module, note('page')),
    picture(photograph, pool).then(note('picture')),
    picture(photograph, pool).then(note('picture')),
    photograph.withModule(module, note('page')),
  ]);
  const steps = order.map((step) => step.split(' ')[0]);
  assert.deepEqual(steps, ['picture', 'page', 'picture', 'picture', 'page']);
  assert.deepEqual(
    order.filter((step) => step.startsWith('page')),
    ['page 4', 'page 4'],
  );
});

test('a failure of one use is not the next one’s', async () => {
  const { photograph, has, module } = received();
  const failing = photograph.withModule(module, () => Promise.reject(new Error('no adapter')));
  const next = photograph.withModule(module, () => has.size);
  await assert.rejects(failing, /no adapter/);
  assert.equal(await next, 4);
});

test('without workers all tiles stay', async () => {
  const { photograph, has, module } = received();
  const pool = new WorkerPool(() => null, 2);
  await assert.rejects(picture(photograph, pool), { code: 'worker-unavailable' });
  assert.equal(await photograph.withModule(module, () => has.size), 4);
});

/** @param to does something while a worker stops */
async function loses(
  to: (photograph: Photograph, pool: WorkerPool, module: DrawingModule) => Promise<unknown>,
  idle: boolean,
) {
  const { pool, workers } = crewOf(2);
  const { photograph, state, module } = received();
  await picture(photograph, pool);
  const worker = workers[1] as FakeWorker;
  if (idle) worker.die();
  else worker.slow = true;
  const doing = assert.rejects(to(photograph, pool, module), {
    code: 'photo-lost',
    message: /out of memory/,
  });
  await settle();
  if (!idle) worker.die();
  await doing;
  // Never again as if it were whole.
  await assert.rejects(
    photograph.withModule(module, () => {}),
    { code: 'photo-lost' },
  );
  await assert.rejects(picture(photograph, pool), { code: 'photo-lost' });
  await settle();
  assert.ok(workers.every(({ ended }) => ended));
  photograph.free();
  await settle();
  assert.equal(state.alive, 0);
}

for (const idle of [true, false]) {
  const when = idle ? 'before' : 'while';
  test(`tiles lost ${when} it is relit make it useless`, () => loses(picture, idle));
  test(`tiles lost ${when} they are given back make it useless`, () =>
    loses((photograph, _, module) => photograph.withModule(module, () => {}), idle));
}

test('tiles lost on their way to a worker make it useless', async () => {
  const { pool } = crewOf(1, (worker) => {
    worker.start();
    const answer = worker.answer.bind(worker);
    worker.answer = (request) => {
      if (request.task.kind !== 'put' || request.task.index !== 2) answer(request);
      else setImmediate(() => worker.die());
    };
  });
  const { photograph, module } = received();
  await assert.rejects(picture(photograph, pool), { code: 'photo-lost' });
  await assert.rejects(
    photograph.withModule(module, () => {}),
    { code: 'photo-lost' },
  );
});

test('tiles that cannot be sent to a worker are not lost, nor where it stops afterwards', async () => {
  const { pool, workers } = crewOf(1, (worker) => {
    worker.start();
    if (workers.length === 1) worker.refusal = new Error('no memory to send it');
  });
  const { photograph } = received();
  await assert.rejects(picture(photograph, pool), /no memory/);
  workers[0]?.die();
  await assert.rejects(picture(photograph, pool), { code: 'worker-unavailable' });
  assert.deepEqual(await picture(photograph, pool), ALL);
  assert.equal(workers.length, 2);
});

test('a worker that stops while another starts loses nothing', async () => {
  const { pool, workers } = crewOf(2, () => {});
  const { photograph, has, module } = received();
  const frame = assert.rejects(picture(photograph, pool), { code: 'worker-unavailable' });
  await settle();
  workers[0]?.start();
  await settle();
  workers[0]?.die();
  workers[1]?.start();
  await frame;
  assert.equal(await photograph.withModule(module, () => has.size), 4);
});

test('a tile that the page’s module has no memory for is not lost', async () => {
  const { pool } = crewOf(2);
  const { photo, has, state, module } = photoOf(4);
  const photograph = Photograph.decoded(photo);
  await picture(photograph, pool);
  state.refuses = true;
  await assert.rejects(
    photograph.withModule(module, () => {}),
    { code: 'format-limit' },
  );
  state.refuses = false;
  assert.deepEqual(await picture(photograph, pool), ALL);
  assert.equal(await photograph.withModule(module, () => has.size), 4);
});

test('one that is freed keeps nobody waiting, and is freed once nobody reads it', async () => {
  const { pool, workers, alive } = crewOf(2);
  const { photograph, state, module } = received();
  await picture(photograph, pool);
  for (const worker of workers) worker.slow = true;
  const frame = assert.rejects(picture(photograph, pool), { code: 'internal' });
  const next = assert.rejects(
    photograph.withModule(module, () => {}),
    { code: 'internal' },
  );
  await settle();
  photograph.free();
  await frame;
  await next;
  await settle();
  assert.deepEqual([state.alive, await alive()], [0, 0]);
});

test('one that is freed while workers start takes none', async () => {
  const { pool, workers, alive } = crewOf(2, () => {});
  const { photograph, state } = received();
  const frame = assert.rejects(picture(photograph, pool), { code: 'internal' });
  await settle();
  assert.equal(await alive(), 2);
  photograph.free();
  await settle();
  for (const worker of workers) worker.start();
  await frame;
  await settle();
  assert.deepEqual([state.alive, await alive()], [0, 0]);
  assert.ok(workers.every(({ log }) => !log.includes('put')));
});

test('tiles go from one module of the page to another, and who uses them is told before', async () => {
  const { photo, has, state, module } = photoOf(4);
  const photograph = Photograph.decoded(photo);
  const told: string[] = [];
  const leave = () => told.push(`${has.size} to leave`);
  await photograph.withModule(module, () => {}, { leave });
  assert.deepEqual([has.size, state.alive, told], [4, 1, []]);
  await photograph.withModule({ ...module }, () => {});
  assert.deepEqual([has.size, state.alive, told], [4, 1, ['4 to leave']]);
  const { pool } = crewOf(2);
  assert.deepEqual(await picture(photograph, pool), ALL);
  assert.deepEqual([has.size, state.alive, told], [0, 0, ['4 to leave']]);
});

test('tiles that a module has no memory for stay where they were', async () => {
  const { photo, has, state, module } = photoOf(4);
  const photograph = Photograph.decoded(photo);
  state.refuses = true;
  await assert.rejects(
    photograph.withModule(module, () => {}),
    { code: 'format-limit' },
  );
  state.refuses = false;
  assert.equal(await photograph.withModule({ ...module }, () => has.size), 4);
  assert.equal(state.alive, 1);
  photograph.free();
  await settle();
  assert.equal(state.alive, 0);
});

test('metadata that are no JSON object are format-invalid, and the photograph is freed', () => {
  for (const metadata of ['[]', '', '1', '{"a": }', 'null']) {
    const { photo, state } = photoOf(1);
    const wrong = { ...photo, metadata };
    assert.throws(() => Photograph.decoded(wrong), { code: 'format-invalid' });
    assert.equal(state.alive, 0);
  }
});
