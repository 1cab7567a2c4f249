import assert from 'node:assert/strict';
import { test } from 'node:test';
import { QualityController } from './quality-controller.js';

/** A motion: frames one after another, each taking what `cost` says of the share it is drawn by. */
function animate(controller: QualityController, start = 0) {
  let now = start;
  /** The share of each frame. */
  const shares: number[] = [];
  const frames = (count: number, cost: (share: number, frame: number) => number, gap = 0) => {
    for (let frame = 0; frame < count; frame += 1) {
      const share = controller.quality;
      const endMs = now + cost(share, frame);
      shares.push(share);
      controller.recordFrame(now, endMs);
      now = endMs + gap;
    }
  };
  return { frames, shares, rest: (ms: number) => (now += ms) };
}

/** How often the share changed. */
function changes(shares: readonly number[]): number {
  return shares.filter((share, i) => i > 0 && share !== shares[i - 1]).length;
}

/** A display that shows a frame at its next refresh, however soon it was done. */
function shownAt(hertz: number, cost: (share: number) => number) {
  const period = 1000 / hertz;
  return (share: number) => period * Math.ceil(cost(share) / period - 1e-9);
}

/** So that no limit is met by chance; the same each time. */
function noise(frame: number): number {
  return ((frame * 7919) % 13) / 13 - 0.5;
}

const linear = (full: number) => (share: number) => full * share;

for (const [what, cost] of [
  ['at 144 Hz', 1000 / 144],
  ['at 60 Hz', 1000 / 60],
  ['at 30 Hz', 1000 / 30],
] as const) {
  test(`frames in time are drawn in full: ${what}`, () => {
    const controller = new QualityController();
    const { frames, shares } = animate(controller);
    frames(1000, (_, frame) => cost + 2 * noise(frame));
    assert.deepEqual(new Set(shares), new Set([1]));
  });
}

for (const [full, share] of [
  [50, 1 / 2],
  [65, 1 / 2],
  [100, 1 / 4],
  [1000, 1 / 4],
] as const) {
  test(`frames of ${full} ms are drawn by ${share} within a dozen`, () => {
    const controller = new QualityController();
    const { frames, shares } = animate(controller);
    frames(100, linear(full));
    assert.deepEqual(new Set(shares.slice(12)), new Set([share]));
    assert.equal(changes(shares), 1, 'at once');
  });
}

test('hiccups change nothing', () => {
  const controller = new QualityController();
  const { frames, shares } = animate(controller);
  frames(1000, (_, frame) => (frame % 7 < 3 ? 300 : 20));
  assert.deepEqual(new Set(shares), new Set([1]));
});

test('detail is back once there is time again, step by step', () => {
  const controller = new QualityController();
  const { frames, shares } = animate(controller);
  frames(20, linear(120));
  assert.equal(controller.quality, 1 / 4);
  shares.length = 0;
  frames(100, linear(16));
  assert.deepEqual([...new Set(shares)], [1 / 4, 1 / 2, 1]);
  assert.equal(changes(shares), 2);
});

test('detail is back also where a display shows frames no sooner', () => {
  const controller = new QualityController();
  const { frames } = animate(controller);
  frames(20, shownAt(60, linear(120)));
  assert.equal(controller.quality, 1 / 4);
  frames(100, shownAt(60, linear(16)));
  assert.equal(controller.quality, 1);
});

test('detail is back in the end where it could not be expected to fit', () => {
  const controller = new QualityController();
  const { frames } = animate(controller);
  frames(20, shownAt(30, linear(120)));
  assert.equal(controller.quality, 1 / 4);
  frames(1500, shownAt(30, linear(30)));
  assert.equal(controller.quality, 1);
});

for (const full of [42, 48, 60, 75, 85, 100, 130]) {
  test(`what lies between two steps does not go to and fro: ${full} ms`, () => {
    for (const hertz of [60, 144, 1e6]) {
      const controller = new QualityController();
      const { frames, shares } = animate(controller);
      const shown = shownAt(hertz, linear(full));
      frames(1000, (share, frame) => shown(share) * (1 + 0.1 * noise(frame)));
      // Down, and at most two tries of more.
      assert.ok(changes(shares) <= 5, `${changes(shares)} changes at ${hertz} Hz`);
      const slow = shares.filter((share) => shown(share) > 40).length;
      assert.ok(slow <= 8 + 2 * 7, `${slow} slow frames at ${hertz} Hz`);
    }
  });
}

test('where more is expected to fit and does not, tries become rare', () => {
  const controller = new QualityController();
  const { frames, shares } = animate(controller);
  // Half of them take next to nothing: 60 Hz promises what full detail does not hold.
  frames(10_000, (share) => (share === 1 ? 60 : 1000 / 60));
  const tries = (changes(shares) - 1) / 2;
  assert.ok(tries > 3 && tries <= 10, `${tries} tries`);
  assert.ok(changes(shares.slice(5000)) <= 6, 'one in 1920 frames');
});

test('a page that is slow by itself is left in full detail', () => {
  for (const cost of [45, 100]) {
    const controller = new QualityController();
    const { frames, shares } = animate(controller);
    frames(10_000, (_, frame) => cost + noise(frame));
    const less = shares.filter((share) => share < 1).length;
    assert.ok(less > 0 && less <= 5 * 7, `${less} frames in less detail`);
    assert.deepEqual(new Set(shares.slice(20, 1000)), new Set([1]), 'and for long');
  }
});

test('a page that is slow by itself is not taken for one that is slow ever after', () => {
  const controller = new QualityController();
  const { frames } = animate(controller);
  frames(20, () => 60);
  assert.equal(controller.quality, 1);
  frames(1100, linear(60));
  assert.equal(controller.quality, 1 / 2);
});

test('a page that is slow by itself is found out, whatever happened when less was tried', () => {
  const controller = new QualityController();
  const { frames } = animate(controller);
  // Something else kept it busy just before.
  frames(8, () => 250);
  frames(100, () => 100);
  assert.equal(controller.quality, 1 / 4);
  frames(600, () => 100);
  assert.equal(controller.quality, 1);
});

test('frames that are late even by the least are drawn by that', () => {
  const controller = new QualityController();
  const { frames, shares } = animate(controller);
  frames(3000, linear(400));
  const more = shares.slice(12).filter((share) => share > 1 / 4).length;
  assert.ok(more <= 2 * 7, `${more} frames in more detail`);
});

test('the time between motions, and between frames of a slow film, is not a frame’s', () => {
  for (const gap of [30, 90, 150, 500]) {
    const controller = new QualityController();
    const { frames, shares } = animate(controller);
    frames(300, () => 1000 / 60, gap);
    assert.deepEqual(new Set(shares), new Set([1]), `gaps of ${gap} ms`);
  }
});

test('motions part at a pause, and the first frame of each does not count', () => {
  const controller = new QualityController();
  const { frames, shares, rest } = animate(controller);
  for (let stroke = 0; stroke < 50; stroke += 1) {
    // A device that wakes up.
    frames(30, (_, frame) => (frame === 0 ? 200 : 16));
    rest(120);
  }
  assert.deepEqual(new Set(shares), new Set([1]));
});

test('motions of one frame each tell nothing', () => {
  for (const [gap, share] of [
    [99, 1 / 2],
    [101, 1],
  ] as const) {
    const controller = new QualityController();
    animate(controller).frames(50, linear(60), gap);
    assert.equal(controller.quality, share, `gaps of ${gap} ms`);
  }
});

test('what was learnt in short motions holds for the next', () => {
  const controller = new QualityController();
  const { frames, shares, rest } = animate(controller);
  for (let stroke = 0; stroke < 10; stroke += 1) {
    frames(4, linear(150));
    rest(2000);
  }
  assert.equal(controller.quality, 1 / 4);
  assert.equal(changes(shares), 1);
});
