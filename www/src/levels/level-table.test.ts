import assert from 'node:assert/strict';
import test from 'node:test';
import { LevelTable } from './level-table.js';

/** 1500 x 900 pixels in three levels with shards of 512: six and two of them, and the root. */
const SHARDS = [
  [1, 0, 0],
  [1, 1, 0],
  [0, 0, 0],
  [0, 1, 0],
  [0, 0, 1],
  [0, 1, 1],
  [0, 2, 0],
  [0, 2, 1],
].flatMap((shard, i) => [...shard, 100 * i, 100 * i + 100]);
const TABLE = new LevelTable(Float64Array.from([1500, 900, 750, 450, 3, 512, ...SHARDS]));

test('the shards of a level are those with pixels of the part', () => {
  const all = { left: 0, top: 0, right: 1500, bottom: 900 };
  assert.equal(TABLE.shardsIn(0, all).length, 6);
  assert.equal(TABLE.shardsIn(1, all).length, 2);
  assert.deepEqual(TABLE.shardsIn(2, all), [], 'the root is no shard');
  const part = { left: 511.5, top: 600, right: 1024, bottom: 601 };
  assert.deepEqual(TABLE.shardsIn(0, part), [
    { level: 0, x: 0, y: 1 },
    { level: 0, x: 1, y: 1 },
  ]);
  assert.deepEqual(TABLE.shardsIn(1, part), [{ level: 1, x: 0, y: 0 }]);
  const beside = { left: -500, top: 2000, right: -1, bottom: 3000 };
  assert.deepEqual(TABLE.shardsIn(0, beside), []);
});

test('a shard has its bytes, and its pixels on level 0', () => {
  assert.deepEqual(TABLE.bytesOf({ level: 0, x: 2, y: 1 }), { start: 700, end: 800 });
  assert.deepEqual(TABLE.bytesOf({ level: 1, x: 1, y: 0 }), { start: 100, end: 200 });
  const rect = { left: 1024, top: 0, right: 2048, bottom: 1024 };
  assert.deepEqual(TABLE.rectOf({ level: 1, x: 1, y: 0 }), rect);
});

test('the pixels of a shard in view have a margin, and end where it ends', () => {
  const view = { left: 600, top: 100, right: 900, bottom: 2200 };
  const part = (level: number, x: number, y: number) =>
    TABLE.pixelsIn(view, { level, x, y }, { width: 512, height: 450 });
  assert.deepEqual(part(0, 1, 0), { left: 56, top: 68, right: 420, bottom: 450 });
  assert.deepEqual(part(1, 0, 0), { left: 268, top: 18, right: 482, bottom: 450 });
  assert.deepEqual(part(0, 2, 0), { left: 0, top: 68, right: 0, bottom: 450 });
});

test('a photograph of another place is refused as a shard', () => {
  const shard = { level: 1, x: 1, y: 0 };
  const geometry = Float64Array.of(238, 450, 100, 99, 15, 32, 512, 0, 200, 0, 375, 225);
  TABLE.checkPlace(shard, { width: 238, height: 450, geometry });
  const refused = (width: number, change: number) => {
    const other = geometry.map((value, i) => (i === change ? value + 1 : value));
    const check = () => TABLE.checkPlace(shard, { width, height: 450, geometry: other });
    assert.throws(check, { code: 'format-invalid', message: /shard 1, 0 of level 1/ });
  };
  refused(239, -1);
  for (const change of [6, 7, 10, 11]) refused(238, change);
});
