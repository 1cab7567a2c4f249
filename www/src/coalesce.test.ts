import assert from 'node:assert/strict';
import test from 'node:test';
import { type ByteRange, coalesce, RangeSet } from './coalesce.js';

const LIMITS = { gapBytes: 1000, maxBytes: 10_000 };

function ranges(...pairs: [number, number][]): ByteRange[] {
  return pairs.map(([start, end]) => ({ start, end }));
}

test('neighbours that follow one another become one, in either direction', () => {
  assert.deepEqual(coalesce(ranges([0, 10], [10, 20], [20, 50]), LIMITS), ranges([0, 50]));
  assert.deepEqual(coalesce(ranges([20, 50], [10, 20], [50, 60]), LIMITS), ranges([10, 60]));
});

test('the order of importance is kept', () => {
  const wanted = ranges([500, 510], [0, 10], [510, 520]);
  assert.deepEqual(coalesce(wanted, LIMITS), wanted);
});

test('no byte is asked for twice, nor are empty ranges', () => {
  assert.deepEqual(
    coalesce(ranges([100, 200], [5, 5], [50, 250], [120, 130]), LIMITS),
    ranges([50, 250]),
  );
  assert.deepEqual(coalesce([], LIMITS), []);
});

test('gaps are fetched along as long as they are narrow and few', () => {
  const wanted = ranges([0, 1000], [1040, 2000], [2030, 3000]);
  // 70 bytes of gaps for 2930 wanted.
  assert.deepEqual(coalesce(wanted, LIMITS), ranges([0, 3000]));
  assert.deepEqual(coalesce(wanted, { ...LIMITS, gapBytes: 35 }), ranges([0, 1000], [1040, 3000]));
  // Not enough is wanted for both gaps: the narrower one.
  assert.deepEqual(
    coalesce(ranges([0, 400], [440, 800], [815, 1000]), LIMITS),
    ranges([0, 400], [440, 1000]),
  );
});

test('what lies within a gap is not asked for again', () => {
  assert.deepEqual(
    coalesce(ranges([1010, 1020], [9000, 9999], [0, 1000], [1030, 2000]), LIMITS),
    ranges([1010, 1020], [9000, 9999], [0, 1010], [1020, 2000]),
  );
  assert.deepEqual(
    coalesce(ranges([0, 1000], [1030, 2000], [1010, 1020]), LIMITS),
    ranges([0, 2000]),
  );
});

test('long ranges are split', () => {
  assert.deepEqual(
    coalesce(ranges([5, 25_000]), LIMITS),
    ranges([5, 10_005], [10_005, 20_005], [20_005, 25_000]),
  );
});

test('what matters more does not wait for much else', () => {
  const descending = ranges([9000, 10_000], [7000, 9000]);
  assert.deepEqual(coalesce(descending, LIMITS), descending);
  assert.deepEqual(
    coalesce(ranges([9000, 9900], [8500, 9000], [8000, 8500], [7500, 8000], [7000, 7500]), LIMITS),
    ranges([8000, 9900], [7000, 8000]),
  );
});

test('whatever the ranges: all that is wanted, nothing twice, little for nothing', () => {
  let seed = 1;
  const random = (below: number) => {
    seed = (seed * 48_271) % 2_147_483_647;
    return seed % below;
  };
  for (let round = 0; round < 500; round++) {
    const wanted = Array.from({ length: 1 + random(30) }, () => {
      const start = random(20_000);
      return { start, end: start + random(1500) };
    });
    const asked = coalesce(wanted, { gapBytes: random(300), maxBytes: 500 + random(5000) });
    const union = new RangeSet();
    for (const range of wanted) union.add(range);
    const all = new RangeSet();
    for (const range of asked) assert.deepEqual(all.add(range), [range], 'nothing twice');
    for (const range of wanted) assert.deepEqual(all.add(range), [], 'nothing left out');
    assert.ok(all.bytes() <= 1.05 * union.bytes(), `${all.bytes()} for ${union.bytes()}`);
  }
});

test('a set of bytes tells what is new, and how many it has', () => {
  const set = new RangeSet();
  assert.deepEqual(set.add({ start: 10, end: 20 }), ranges([10, 20]));
  assert.deepEqual(set.add({ start: 30, end: 40 }), ranges([30, 40]));
  assert.deepEqual(set.add({ start: 5, end: 45 }), ranges([5, 10], [20, 30], [40, 45]));
  assert.deepEqual(set.add({ start: 5, end: 45 }), []);
  assert.equal(set.bytes(), 40);
  assert.equal(set.bytes(15), 10);
  assert.equal(set.bytes(0), 0);
});
