import assert from 'node:assert/strict';
import { test } from 'node:test';
import { QualityController } from './quality-controller.js';

/** An animation: each frame takes `cost(quality)` milliseconds. */
function animate(controller: QualityController, start = 0) {
  let now = start;
  /** The quality of each frame. */
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

/** How often the quality changed. */
function changes(shares: readonly number[]): number {
  return shares.filter((share, i) => i > 0 && share !== shares[i - 1]).length;
}

/** A display shows a frame at its next refresh, however early it is done. */
function shownAt(hertz: number, cost: (share: number) => number) {
  const period = 1000 / hertz;
  return (share: number) => period * Math.ceil(cost(share) / period - 1e-9);
}

/** Deterministic, from -0.5 to 0.5. */
function noise(frame: number): number {
  return ((frame * 7919) % 13) / 13 - 0.5;
}

const linear = (full: number) => (share: number) => full * share;

for (const [what, cost] of [
  ['at 144 Hz', 1000 / 144],
  ['at 60 Hz', 1000 / 60],
  ['at 30 Hz', 1000 / 30],
] as const) {
  test(`fast frames have full quality: ${what}`, () => {
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
  test(`frames of ${full} ms have the quality ${share} after a dozen`, () => {
    const controller = new QualityController();
    const { frames, shares } = animate(controller);
    frames(100, linear(full));
    assert.deepEqual(new Set(shares.slice(12)), new Set([share]));
    assert.equal(changes(shares), 1, 'at once');
  });
}

test('with another factor, quality changes by that', () => {
  const controller = new QualityController(4);
  const { frames, shares } = animate(controller);
  frames(20, linear(100));
  assert.equal(controller.quality, 1 / 4);
  frames(20, linear(600));
  assert.equal(controller.quality, 1 / 16);
  frames(200, linear(30));
  assert.deepEqual(new Set(shares.slice(40)), new Set([1 / 16, 1 / 4, 1]));
});

test('a lower quality that is not there yet is waited for', () => {
  const slow = new QualityController(4);
  const waiting = animate(slow);
  waiting.frames(8, () => 100);
  assert.equal(slow.quality, 1 / 4);
  for (let frame = 0; frame < 50; frame += 1) {
    slow.discardFrames();
    waiting.frames(1, () => 100);
  }
  assert.equal(slow.quality, 1 / 4);
  waiting.frames(100, linear(100));
  assert.equal(slow.quality, 1 / 4);
});

test('outliers change nothing', () => {
  const controller = new QualityController();
  const { frames, shares } = animate(controller);
  frames(1000, (_, frame) => (frame % 7 < 3 ? 300 : 20));
  assert.deepEqual(new Set(shares), new Set([1]));
});

test('quality rises step by step once frames are fast', () => {
  const controller = new QualityController();
  const { frames, shares } = animate(controller);
  frames(20, linear(120));
  assert.equal(controller.quality, 1 / 4);
  shares.length = 0;
  frames(100, linear(16));
  assert.deepEqual([...new Set(shares)], [1 / 4, 1 / 2, 1]);
  assert.equal(changes(shares), 2);
});

test('quality rises even if the display limits the frame rate', () => {
  const controller = new QualityController();
  const { frames } = animate(controller);
  frames(20, shownAt(60, linear(120)));
  assert.equal(controller.quality, 1 / 4);
  frames(100, shownAt(60, linear(16)));
  assert.equal(controller.quality, 1);
});

test('quality rises in the end even if it is not expected to fit', () => {
  const controller = new QualityController();
  const { frames } = animate(controller);
  frames(20, shownAt(30, linear(120)));
  assert.equal(controller.quality, 1 / 4);
  frames(1500, shownAt(30, linear(30)));
  assert.equal(controller.quality, 1);
});

for (const full of [42, 48, 60, 75, 85, 100, 130]) {
  test(`quality does not oscillate between two levels: ${full} ms`, () => {
    for (const hertz of [60, 144, 1e6]) {
      const controller = new QualityController();
      const { frames, shares } = animate(controller);
      const shown = shownAt(hertz, linear(full));
      frames(1000, (share, frame) => shown(share) * (1 + 0.1 * noise(frame)));
      // One drop and at most two attempts to raise.
      assert.ok(changes(shares) <= 5, `${changes(shares)} changes at ${hertz} Hz`);
      const slow = shares.filter((share) => shown(share) > 40).length;
      assert.ok(slow <= 8 + 2 * 7, `${slow} slow frames at ${hertz} Hz`);
    }
  });
}

test('attempts that fail against expectation become rare', () => {
  const controller = new QualityController();
  const { frames, shares } = animate(controller);
  // Half of the components take next to nothing, so that full quality is expected to fit at 60 Hz.
  frames(10_000, (share) => (share === 1 ? 60 : 1000 / 60));
  const tries = (changes(shares) - 1) / 2;
  assert.ok(tries > 3 && tries <= 10, `${tries} tries`);
  assert.ok(changes(shares.slice(5000)) <= 6, 'one in 1920 frames');
});

test('if the page itself is slow, quality stays full', () => {
  for (const cost of [45, 100]) {
    const controller = new QualityController();
    const { frames, shares } = animate(controller);
    frames(10_000, (_, frame) => cost + noise(frame));
    const less = shares.filter((share) => share < 1).length;
    assert.ok(less > 0 && less <= 5 * 7, `${less} frames of less quality`);
    assert.deepEqual(new Set(shares.slice(20, 1000)), new Set([1]), 'for long');
  }
});

test('a lower quality is tried again later on a slow page', () => {
  const controller = new QualityController();
  const { frames } = animate(controller);
  frames(20, () => 60);
  assert.equal(controller.quality, 1);
  frames(1100, linear(60));
  assert.equal(controller.quality, 1 / 2);
});

test('a slow page is recognised even if the first drop seemed to help', () => {
  const controller = new QualityController();
  const { frames } = animate(controller);
  // Something else kept the page busy just before.
  frames(8, () => 250);
  frames(100, () => 100);
  assert.equal(controller.quality, 1 / 4);
  frames(600, () => 100);
  assert.equal(controller.quality, 1);
});

test('if the lowest quality is too slow, it is used all the same', () => {
  const controller = new QualityController();
  const { frames, shares } = animate(controller);
  frames(3000, linear(400));
  const more = shares.slice(12).filter((share) => share > 1 / 4).length;
  assert.ok(more <= 2 * 7, `${more} frames of more quality`);
});

test('pauses between frames do not count', () => {
  for (const gap of [30, 90, 150, 500]) {
    const controller = new QualityController();
    const { frames, shares } = animate(controller);
    frames(300, () => 1000 / 60, gap);
    assert.deepEqual(new Set(shares), new Set([1]), `gaps of ${gap} ms`);
  }
});

test('the first frame after a pause does not count', () => {
  const controller = new QualityController();
  const { frames, shares, rest } = animate(controller);
  for (let stroke = 0; stroke < 50; stroke += 1) {
    // The device wakes up.
    frames(30, (_, frame) => (frame === 0 ? 200 : 16));
    rest(120);
  }
  assert.deepEqual(new Set(shares), new Set([1]));
});

test('animations of one frame change nothing', () => {
  for (const [gap, share] of [
    [99, 1 / 2],
    [101, 1],
  ] as const) {
    const controller = new QualityController();
    animate(controller).frames(50, linear(60), gap);
    assert.equal(controller.quality, share, `gaps of ${gap} ms`);
  }
});

test('short animations add up', () => {
  const controller = new QualityController();
  const { frames, shares, rest } = animate(controller);
  for (let stroke = 0; stroke < 10; stroke += 1) {
    frames(4, linear(150));
    rest(2000);
  }
  assert.equal(controller.quality, 1 / 4);
  assert.equal(changes(shares), 1);
});
