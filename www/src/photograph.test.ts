import assert from 'node:assert/strict';
import test from 'node:test';
import { Crew } from './crew.js';
import { crewOf, type FakeWorker, light, painted, photoOf, SHOWING, settle } from './crew-fakes.js';
import { Photograph, type TileBytes } from './photograph.js';

const ALL = [0, 1, 2, 3];

/** One of four tiles, as a worker gave them. */
function received() {
  const { photo, has, state } = photoOf(4);
  const tiles = ALL.map((index) => photo.takeTile(index) as TileBytes);
  return { photograph: Photograph.received(photo, tiles, 77), has, state };
}

async function picture(photograph: Photograph, crew: Crew): Promise<number[]> {
  return photograph.withCrew(crew, async (shift) => painted(await shift.relight(light, SHOWING)));
}

test('tiles go straight to the crew, and back into the page’s module when they are wanted there', async () => {
  const { crew, alive } = crewOf(2);
  const { photograph, has } = received();
  assert.deepEqual(await picture(photograph, crew), ALL);
  assert.equal(has.size, 0);
  assert.equal(await photograph.inPage(() => has.size), 4);
  assert.equal(alive(), 0, 'workers without a photograph end');
  assert.deepEqual(await picture(photograph, crew), ALL);
  assert.equal(has.size, 0);
  assert.equal(photograph.facts.decodedBytes, 77);
});

test('what is asked for is done in order, whatever takes long', async () => {
  const { crew } = crewOf(2);
  const { photo, has } = photoOf(4);
  const photograph = Photograph.decoded(photo);
  const order: string[] = [];
  const note = (what: string) => () => {
    order.push(`${what} ${has.size}`);
  };
  await Promise.all([
    picture(photograph, crew).then(note('picture')),
    photograph.inPage(note('page')),
    picture(photograph, crew).then(note('picture')),
    picture(photograph, crew).then(note('picture')),
    photograph.inPage(note('page')),
  ]);
  const steps = order.map((step) => step.split(' ')[0]);
  assert.deepEqual(steps, ['picture', 'page', 'picture', 'picture', 'page']);
  assert.deepEqual(
    order.filter((step) => step.startsWith('page')),
    ['page 4', 'page 4'],
  );
});

test('a failure of one use is not the next one’s', async () => {
  const { photograph } = received();
  const failing = photograph.inPage(() => Promise.reject(new Error('no adapter')));
  const next = photograph.inPage((photo) => photo.tiles);
  await assert.rejects(failing, /no adapter/);
  assert.equal(await next, 4);
});

test('without workers all tiles stay', async () => {
  const { photograph, has } = received();
  const crew = new Crew(() => null, 2);
  await assert.rejects(picture(photograph, crew), { code: 'worker-unavailable' });
  assert.equal(await photograph.inPage(() => has.size), 4);
});

/** @param to does something while a worker stops */
async function loses(to: (photograph: Photograph, crew: Crew) => Promise<unknown>, idle: boolean) {
  const { crew, workers } = crewOf(2);
  const { photograph, state } = received();
  await picture(photograph, crew);
  const worker = workers[1] as FakeWorker;
  if (idle) worker.die();
  else worker.slow = true;
  const doing = assert.rejects(to(photograph, crew), {
    code: 'photo-lost',
    message: /out of memory/,
  });
  await settle();
  if (!idle) worker.die();
  await doing;
  // Never again as if it were whole.
  await assert.rejects(
    photograph.inPage(() => {}),
    { code: 'photo-lost' },
  );
  await assert.rejects(picture(photograph, crew), { code: 'photo-lost' });
  await settle();
  assert.ok(workers.every(({ ended }) => ended));
  photograph.free();
  await settle();
  assert.equal(state.freed, 1);
}

for (const idle of [true, false]) {
  const when = idle ? 'before' : 'while';
  test(`tiles lost ${when} it is relit make it useless`, () => loses(picture, idle));
  test(`tiles lost ${when} they are given back make it useless`, () =>
    loses((photograph) => photograph.inPage(() => {}), idle));
}

test('tiles lost on their way to a worker make it useless', async () => {
  const { crew } = crewOf(1, (worker) => {
    worker.start();
    const answer = worker.answer.bind(worker);
    worker.answer = (request) => {
      if (request.task.kind !== 'put' || request.task.index !== 2) answer(request);
      else setImmediate(() => worker.die());
    };
  });
  const { photograph } = received();
  await assert.rejects(picture(photograph, crew), { code: 'photo-lost' });
  await assert.rejects(
    photograph.inPage(() => {}),
    { code: 'photo-lost' },
  );
});

test('tiles that cannot be sent to a worker are not lost, nor where it stops afterwards', async () => {
  const { crew, workers } = crewOf(1, (worker) => {
    worker.start();
    if (workers.length === 1) worker.refusal = new Error('no memory to send it');
  });
  const { photograph } = received();
  await assert.rejects(picture(photograph, crew), /no memory/);
  workers[0]?.die();
  await assert.rejects(picture(photograph, crew), { code: 'worker-unavailable' });
  assert.deepEqual(await picture(photograph, crew), ALL);
  assert.equal(workers.length, 2);
});

test('a worker that stops while another starts loses nothing', async () => {
  const { crew, workers } = crewOf(2, () => {});
  const { photograph, has } = received();
  const frame = assert.rejects(picture(photograph, crew), { code: 'worker-unavailable' });
  await settle();
  workers[0]?.start();
  await settle();
  workers[0]?.die();
  workers[1]?.start();
  await frame;
  assert.equal(await photograph.inPage(() => has.size), 4);
});

test('a tile that the page’s module has no memory for is not lost', async () => {
  const { crew } = crewOf(2);
  const { photo, has } = photoOf(4);
  const photograph = Photograph.decoded(photo);
  await picture(photograph, crew);
  const { putTile } = photo;
  photo.putTile = () => {
    throw Object.assign(new Error('there is no memory'), { code: 'format-limit' });
  };
  await assert.rejects(
    photograph.inPage(() => {}),
    { code: 'format-limit' },
  );
  photo.putTile = putTile;
  assert.deepEqual(await picture(photograph, crew), ALL);
  assert.equal(await photograph.inPage(() => has.size), 4);
});

test('one that is freed keeps nobody waiting, and is freed once nobody reads it', async () => {
  const { crew, workers, alive } = crewOf(2);
  const { photograph, state } = received();
  await picture(photograph, crew);
  for (const worker of workers) worker.slow = true;
  const frame = assert.rejects(picture(photograph, crew), { code: 'internal' });
  const next = assert.rejects(
    photograph.inPage(() => {}),
    { code: 'internal' },
  );
  await settle();
  photograph.free();
  await frame;
  await next;
  await settle();
  assert.deepEqual([state.freed, alive()], [1, 0]);
});

test('one that is freed while workers start takes none', async () => {
  const { crew, workers, alive } = crewOf(2, () => {});
  const { photograph, state } = received();
  const frame = assert.rejects(picture(photograph, crew), { code: 'internal' });
  await settle();
  assert.equal(alive(), 2);
  photograph.free();
  await settle();
  for (const worker of workers) worker.start();
  await frame;
  await settle();
  assert.deepEqual([state.freed, alive()], [1, 0]);
  assert.ok(workers.every(({ log }) => !log.includes('put')));
});
