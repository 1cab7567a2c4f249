import assert from 'node:assert/strict';
import test from 'node:test';
import { keyOf, LevelTable, type ShardId } from './level-table.js';
import { selectShards } from './shard-selection.js';

/** 16384 x 16384 pixels in six levels with shards of 512. */
const TABLE = new LevelTable(Float64Array.of(16384, 16384, 8192, 8192, 6, 512));
const NONE = () => false;
const ALL = () => true;

function view(left: number, top: number, pixels: number, scale: number) {
  return { rect: { left, top, right: left + pixels, bottom: top + pixels }, scale };
}

test('the level has about one pixel for each device pixel', () => {
  const level = (scale: number) =>
    selectShards(TABLE, view(0, 0, 800, scale), ALL, 40, false).level;
  assert.deepEqual([4, 1, 0.75, 0.6, 0.5, 0.3, 0.01].map(level), [0, 0, 0, 1, 1, 2, 5]);
});

test('the next coarser level comes first, and then the shards from the middle outwards', () => {
  const { needed, isComplete } = selectShards(TABLE, view(100, 100, 1400, 1), NONE, 40, false);
  assert.deepEqual(new Set(needed.slice(0, 4).map(({ level }) => level)), new Set([1]));
  const [first, ...others] = needed.slice(4);
  assert.deepEqual(first, { level: 0, x: 1, y: 1 });
  assert.equal(others.length, 8);
  assert.equal(isComplete, false);
  const corners = others.slice(4).map(({ x, y }) => x !== 1 && y !== 1);
  assert.deepEqual(corners, [true, true, true, true]);
});

test('once all shards are there, the coarser level stays if there is room', () => {
  const coarse = (maxShards: number) => {
    const chosen = selectShards(TABLE, view(100, 100, 1400, 1), ALL, maxShards, true);
    assert.equal(chosen.isComplete, true);
    return [chosen.needed.length, chosen.level];
  };
  assert.deepEqual(coarse(13), [13, 1]);
  assert.deepEqual(coarse(12), [12, 1]);
  assert.equal(selectShards(TABLE, view(100, 100, 1400, 1), ALL, 12, false).needed.length, 9);
});

test('a frame of less quality has a coarser level, once that is there', () => {
  const frame = (isLoaded: (shard: ShardId) => boolean) =>
    selectShards(TABLE, view(100, 100, 1400, 1), isLoaded, 40, true);
  const before = frame(({ level }) => level === 0);
  assert.equal(before.level, 0);
  assert.deepEqual([before.isComplete, before.isPending], [true, true]);
  assert.equal(before.needed.filter(({ level }) => level === 1).length, 4);
  const after = frame(({ level }) => level === 1);
  assert.equal(after.level, 1);
  assert.deepEqual([after.isComplete, after.isPending], [true, false]);
  assert.equal(
    after.needed.filter(({ level }) => level === 0).length,
    9,
    'for the picture at rest',
  );
  const small = selectShards(TABLE, view(0, 0, 16384, 1 / 16), NONE, 40, true);
  assert.deepEqual([small.level, small.isComplete], [5, true], 'the root is always there');
  assert.equal(selectShards(TABLE, view(0, 0, 16384, 1 / 64), NONE, 40, true).level, 5);
});

test('before the root, nothing comes first', () => {
  const { needed } = selectShards(TABLE, view(0, 0, 16384, 1 / 16), NONE, 40, false);
  assert.deepEqual(new Set(needed.map(({ level }) => level)), new Set([4]));
  assert.deepEqual(selectShards(TABLE, view(0, 0, 16384, 1 / 64), NONE, 40, false).needed, []);
});

test('a screen with more pixels than shards may have gets a coarser level', () => {
  const { level, needed } = selectShards(TABLE, view(0, 0, 8192, 1), NONE, 40, false);
  assert.equal(level, 2);
  const finest = (shards: readonly ShardId[]) => shards.filter((shard) => shard.level === level);
  assert.equal(finest(needed).length, 16);
  assert.equal(new Set(needed.map(keyOf)).size, needed.length);
});
