import assert from 'node:assert/strict';
import test from 'node:test';
import { recoverTiles } from './recover-tiles.js';
import { COLUMNS, FakeWorker, fakeClient, settle, TILES } from './recovery-fakes.js';
import { TileSchedule } from './tile-schedule.js';

const GRID = { tiles: TILES, tileColumns: COLUMNS };
const ALL = Array.from({ length: TILES }, (_, tile) => tile);
const byNumber = (a: number, b: number) => a - b;

function recoverWith(
  tileWorkers: readonly FakeWorker[],
  coordinator = new FakeWorker(),
  isPrepared = false,
) {
  const shares: number[] = [];
  const clients = tileWorkers.map((worker) => fakeClient(worker));
  const helpers = clients.map((worker) => ({ worker, isPrepared: Promise.resolve(isPrepared) }));
  const done = recoverTiles(fakeClient(coordinator), helpers, GRID, (share) => shares.push(share));
  return { coordinator, done, shares };
}

test('the coordinator alone recovers each tile once', async () => {
  const { coordinator, done, shares } = recoverWith([]);
  await done;
  assert.deepEqual([...coordinator.tiles].sort(byNumber), ALL);
  assert.equal(shares.length, TILES);
  assert.equal(shares.at(-1), 1);
  assert.ok(shares.every((share, i) => i === 0 || share > (shares[i - 1] ?? 1)));
});

test('tile workers get rows from the top, and each tile is recovered once', async () => {
  for (const count of [1, 2, 5]) {
    const workers = Array.from({ length: count }, () => new FakeWorker());
    const { coordinator, done } = recoverWith(workers);
    await done;
    assert.deepEqual([...coordinator.tiles].sort(byNumber), ALL);
    assert.ok(coordinator.log.includes('putTile'), 'tile workers took part');
    assert.ok(coordinator.log.includes('recoverTile'), 'so did the coordinator');
    await settle();
    assert.ok(workers.every(({ hasEnded }) => hasEnded));
    assert.ok(!coordinator.hasEnded);
  }
});

test('rows are requested before their worker needs them', async () => {
  const worker = new FakeWorker();
  const { coordinator, done } = recoverWith([worker]);
  await done;
  const secondRow = coordinator.log.indexOf('packRows', coordinator.log.indexOf('packRows') + 1);
  assert.ok(secondRow < coordinator.log.indexOf('putTile'));
});

test('a worker that has prepared the recovery needs no rows', async () => {
  const worker = new FakeWorker();
  const { coordinator, done } = recoverWith([worker], new FakeWorker(), true);
  await done;
  assert.deepEqual([...coordinator.tiles].sort(byNumber), ALL);
  assert.ok(coordinator.log.includes('putTile'), 'it took part');
  assert.ok(!coordinator.log.includes('pack') && !coordinator.log.includes('packRows'));
  assert.deepEqual([...new Set(worker.log)], ['solveTile']);
});

test('a worker that dies loses nothing: its tiles go to the others', async () => {
  for (const method of ['unpack', 'setRows', 'solveTile'] as const) {
    const dying = new FakeWorker();
    dying.silentMethod = method;
    const { coordinator, done } = recoverWith([dying, new FakeWorker()]);
    await settle();
    assert.ok(dying.log.includes(method), `it is asked to ${method}`);
    dying.crash();
    await done;
    assert.deepEqual([...coordinator.tiles].sort(byNumber), ALL);
  }
});

test('a worker that never starts, and one that cannot do a tile, are left out', async () => {
  const error = { code: 'wasm-unavailable', message: 'no module' };
  const failing = new FakeWorker({
    solveTile: () => {
      throw Object.assign(new Error('memory'), { code: 'recover-memory' });
    },
  });
  const { coordinator, done } = recoverWith([new FakeWorker({}, error), failing]);
  await done;
  assert.deepEqual([...coordinator.tiles].sort(byNumber), ALL);
});

test('the failure of the coordinator ends the recovery and its workers', async () => {
  const coordinator = new FakeWorker({
    recoverTile: () => {
      throw Object.assign(new Error('no memory'), { code: 'recover-memory' });
    },
  });
  const worker = new FakeWorker();
  await assert.rejects(recoverWith([worker], coordinator).done, { code: 'recover-memory' });
  assert.ok(worker.hasEnded);
});

test('a coordinator that dies while it waits for the others is noticed', async () => {
  const coordinator = new FakeWorker();
  const worker = new FakeWorker();
  worker.silentMethod = 'solveTile';
  const { done } = recoverWith([worker], coordinator);
  await settle();
  assert.equal(coordinator.tiles.length, TILES - 1);
  coordinator.crash();
  worker.crash();
  await assert.rejects(done, { code: 'worker-unavailable' });
});

test('a schedule gives every tile once, and again if it comes back', () => {
  const schedule = new TileSchedule(6, 3);
  assert.equal(schedule.claimRow(), 0);
  assert.equal(schedule.takeFromRow(0), 0);
  assert.equal(schedule.takeAny(), 5);
  assert.equal(schedule.claimRow(), 1);
  assert.equal(schedule.claimRow(), undefined);
  // All rows are claimed: the coordinator helps with the last one.
  assert.deepEqual([schedule.takeAny(), schedule.takeAny()], [4, 3]);
  assert.equal(schedule.takeFromRow(1), undefined);
  assert.deepEqual([schedule.takeAny(), schedule.takeAny(), schedule.takeAny()], [2, 1, undefined]);
  for (const tile of [5, 4, 3, 2, 1]) schedule.finish(tile);
  assert.ok(!schedule.isFinished);
  schedule.giveBack(0);
  assert.equal(schedule.takeAny(), 0);
  schedule.finish(0);
  assert.ok(schedule.isFinished);
  assert.equal(schedule.share, 1);
});
