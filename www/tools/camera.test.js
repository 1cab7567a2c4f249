/** The site's photographs from video: synchronisation by the picture alone, averages and faults. */

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { noise } from '../../tests/browser/camera-film.js';
import { FrameAverager } from '../site/recover/camera/frame-averager.js';
import { lightPatterns } from '../site/recover/camera/light-patterns.js';
import { photographPatterns } from '../site/recover/camera/photograph-patterns.js';

const SIDE = 16;
const SAMPLES = 3 * SIDE * SIDE;
const signal = new AbortController().signal;

/** A picture of one colour on the left and another on the right. @param {number} left @param {number} right */
function halves(left, right) {
  return Float32Array.from({ length: SAMPLES }, (_, i) => (i % (3 * SIDE) < 24 ? left : right));
}

/** A camera that plays pictures, each for some frames, with noise. @param {[Float32Array, number][]} film @param {number} deviation */
function play(film, deviation) {
  const random = noise();
  const frames = film.flatMap(([picture, count]) => Array.from({ length: count }, () => picture));
  const last = /** @type {Float32Array} */ (film.at(-1)?.[0]);
  return {
    next: async () => (frames.shift() ?? last).map((value) => value + deviation * random()),
  };
}

/** @param {Float32Array} a @param {Float32Array} b */
function rms(a, b) {
  return Math.sqrt(a.reduce((sum, value, i) => sum + (value - (b[i] ?? 0)) ** 2, 0) / a.length);
}

test('each picture is averaged once, without the frames between two', async () => {
  const pictures = [halves(0, 0), halves(0.8, 0.1), halves(0.1, 0.8), halves(0.5, 0.4)];
  const flood = halves(0.9, 0.9);
  /** @type {[Float32Array, number][]} */
  const film = [[flood, 12]];
  let last = flood;
  for (const [i, picture] of pictures.entries()) {
    const before = last;
    const between = picture.map((value, n) => 0.7 * value + 0.3 * (before[n] ?? 0));
    film.push([between, 1], [picture, 8 + 3 * i]);
    last = picture;
  }
  const averager = new FrameAverager(play(film, 0.02));
  await averager.measureNoise(signal);
  assert.ok(averager.noise > 0.017 && averager.noise < 0.023, `noise ${averager.noise}`);
  for (const picture of pictures) {
    const { photograph, frames } = await averager.next(signal);
    assert.ok(rms(photograph, picture) < (1.15 * 0.02) / Math.sqrt(frames), `${frames} frames`);
    assert.ok(frames >= 4);
  }
});

test('a sample that is saturated in one frame is saturated', async () => {
  const picture = halves(0.5, 0.5);
  const bright = picture.map((value, i) => (i === 7 ? Number.NaN : value));
  const averager = new FrameAverager(
    play(
      [
        [halves(0, 0), 9],
        [bright, 20],
      ],
      0.01,
    ),
  );
  await averager.measureNoise(signal);
  const { photograph } = await averager.next(signal);
  assert.deepEqual(
    [...photograph.keys()].filter((i) => Number.isNaN(photograph[i])),
    [7],
  );
});

test('a picture that does not change, or is never still, is a fault', async () => {
  const still = new FrameAverager(play([[halves(0.5, 0.5), 1]], 0.01));
  await still.measureNoise(signal);
  await assert.rejects(still.next(signal), { code: 'camera-no-signal' });
  /** @type {[Float32Array, number][]} */
  const flicker = Array.from({ length: 400 }, (_, i) => [halves(i % 2, 0.5), 1]);
  const unstable = new FrameAverager(play([[halves(0, 0), 9], ...flicker], 0.01));
  await unstable.measureNoise(signal);
  await assert.rejects(unstable.next(signal), { code: 'camera-unstable' });
});

/** A camera in front of the screen, `delay` frames late. @param {number} gain of full exposure @param {number} delay @param {number} darkest exposure that it can have */
function rig(gain, delay, darkest) {
  const random = noise();
  /** @type {Uint8Array[]} */
  const shown = [];
  let codes = new Uint8Array(SIDE * SIDE);
  let exposure = 1;
  return {
    screen: {
      show: (/** @type {Uint8Array} */ next) => {
        codes = /** @type {any} */ (next);
      },
    },
    camera: {
      next: async () => {
        shown.push(codes);
        const seen = shown[Math.max(0, shown.length - 1 - delay)] ?? codes;
        return Float32Array.from({ length: SAMPLES }, (_, i) => {
          const light = (seen[Math.floor(i / 3)] ?? 0) / 255;
          const value = 0.02 + gain * exposure * light + 0.01 * random();
          return value >= 1 ? Number.NaN : value;
        });
      },
      lock: async () =>
        /** @type {import('../site/recover/camera/camera.js').AutomaticSetting[]} */ ([]),
      darken: async () => {
        exposure /= 2;
        return exposure >= darkest;
      },
    },
  };
}

test('each pattern has its photograph, however late the camera is; a bright one is darkened', async () => {
  const patterns = lightPatterns(SIDE, 12, 3);
  for (const delay of [0, 3, 11]) {
    const { camera, screen } = rig(3, delay, 0.1);
    /** @type {number[]} */
    const errors = [];
    await photographPatterns(
      { camera, screen, patterns },
      {
        signal,
        onPhotograph: ({ pattern, photograph }) => {
          const expected = Float32Array.from({ length: SAMPLES }, (_, i) => {
            return 0.02 + (0.75 * (pattern.codes[Math.floor(i / 3)] ?? 0)) / 255;
          });
          errors.push(rms(photograph, expected));
        },
      },
    );
    assert.equal(errors.length, patterns.length);
    assert.ok(Math.max(...errors) < 0.01, `delay ${delay}: error ${Math.max(...errors)}`);
  }
});

test('a picture that stays too bright is a fault', async () => {
  const { camera, screen } = rig(3, 1, 0.6);
  const patterns = lightPatterns(SIDE, 1, 3);
  const shot = photographPatterns({ camera, screen, patterns }, { signal, onPhotograph: () => {} });
  await assert.rejects(shot, { code: 'camera-saturated' });
});

test('patterns are complete, and neighbours differ when blurred', () => {
  const side = 32;
  const patterns = lightPatterns(side, 4, 1);
  const names = patterns.map(({ name }) => name);
  assert.equal(new Set(names).size, names.length);
  assert.equal(patterns.filter(({ kind }) => kind === 'grayCode').length, 20);
  // Means over squares of four by four elements.
  const blocks = patterns.map(({ codes }) =>
    Array.from({ length: 64 }, (_, block) => {
      const inside = [...codes].filter(
        (_, m) => ((m % side) >> 2) + 8 * (Math.floor(m / side) >> 2) === block,
      );
      return inside.reduce((sum, code) => sum + code, 0) / (255 * inside.length);
    }),
  );
  for (const [i, own] of blocks.entries()) {
    const before = blocks[i - 1];
    if (!before || patterns[i]?.kind === 'random') continue;
    const change = own.reduce((sum, value, b) => sum + Math.abs(value - (before[b] ?? 0)), 0) / 64;
    assert.ok(change > 0.2, `${patterns[i - 1]?.name} and ${patterns[i]?.name}: ${change}`);
  }
});
