/** A film of what a camera sees while the page "Recover" shows its patterns, for Chromium's fake camera. */

import { closeSync, mkdirSync, openSync, readFileSync, writeSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { lightPatterns } from '../../www/site/recover/camera/light-patterns.js';

/** @typedef {import('../../www/site/recover/simulation-types.js').SimulationModule} SimulationModule */

const MODULE = join(import.meta.dirname, '../../target/wasm/site/simulation');
/** Camera pixels of the simulated scene; each is a square of pixels of the film. */
const SIDE = 64;
const BLOCK = 2;
/** Slow, so that a busy machine misses no pattern: the film does not wait for the page. */
const FRAMES_PER_SECOND = 10;
/** Full light at the beginning, until the test has pressed the buttons. */
const LEAD_SECONDS = 8;
/** A pattern's frames are so many and up to three more: screen and camera do not keep step. */
const MIN_FRAMES = 9;
/** Brightest value under full light. */
const WHITE = 0.85;
/** Standard deviation of a pixel, in codes. */
const NOISE_CODES = 1.5;

/**
 * Writes the film, in the format Y4M.
 *
 * @param {string} path
 * @param {{ lightSide: number, patterns: number, seed: number }} capture
 */
export async function writeFilm(path, { lightSide, patterns, seed }) {
  const simulation = await simulate(lightSide);
  const pictures = lightPatterns(lightSide, patterns, seed).map(({ codes }) =>
    simulation.picture(Float32Array.from({ length: 3 * codes.length }, (_, i) => light(codes, i))),
  );
  // The second pattern is full light.
  const [, flood = new Float32Array()] = pictures;
  const gain = WHITE / flood.reduce((a, b) => Math.max(a, b), 0);
  mkdirSync(dirname(path), { recursive: true });
  const file = openSync(path, 'w');
  const side = SIDE * BLOCK;
  writeSync(file, `YUV4MPEG2 W${side} H${side} F${FRAMES_PER_SECOND}:1 Ip A1:1 C420jpeg\n`);
  const random = noise();
  const show = (/** @type {Float32Array} */ picture, /** @type {number} */ frames) => {
    const planes = toPlanes(picture, gain);
    for (let i = 0; i < frames; i += 1) {
      writeSync(file, 'FRAME\n');
      writeSync(
        file,
        planes.map((value) => value + NOISE_CODES * random()),
      );
    }
  };
  show(flood, LEAD_SECONDS * FRAMES_PER_SECOND);
  let last = flood;
  for (const [i, picture] of pictures.entries()) {
    // Its first frame was exposed under both patterns.
    const before = last;
    show(
      picture.map((value, n) => 0.5 * (value + (before[n] ?? 0))),
      1,
    );
    show(picture, MIN_FRAMES - 1 + ((7 * i) % 4));
    last = picture;
  }
  show(last, FRAMES_PER_SECOND);
  closeSync(file);
  simulation.free();
}

/** @param {number} lightSide */
async function simulate(lightSide) {
  const module = /** @type {SimulationModule} */ (await import(`${MODULE}.js`));
  const bytes = readFileSync(`${MODULE}_bg.wasm`);
  await module.default({ module_or_path: /** @type {any} */ (bytes) });
  return module.Simulation.build('stained-glass', SIDE, SIDE, lightSide, lightSide, () => {});
}

/** Linear value of an element's channel. @param {Uint8Array} codes @param {number} i */
function light(codes, i) {
  return (codes[Math.floor(i / 3)] ?? 0) / 255;
}

/** The planes Y, Cb and Cr of 8-bit video, half as large for the colours. @param {Float32Array} picture @param {number} gain */
function toPlanes(picture, gain) {
  const side = SIDE * BLOCK;
  const planes = new Uint8ClampedArray(side * side + 2 * SIDE * SIDE);
  for (let n = 0; n < SIDE * SIDE; n += 1) {
    const [r = 0, g = 0, b = 0] = [0, 1, 2].map((c) => srgb(gain * (picture[3 * n + c] ?? 0)));
    const [x, y] = [n % SIDE, Math.floor(n / SIDE)];
    const luma = 16 + (65.738 * r + 129.057 * g + 25.064 * b) / 256;
    for (let i = 0; i < BLOCK * BLOCK; i += 1) {
      const row = BLOCK * y + Math.floor(i / BLOCK);
      planes[row * side + BLOCK * x + (i % BLOCK)] = luma;
    }
    planes[side * side + n] = 128 + (-37.945 * r - 74.494 * g + 112.439 * b) / 256;
    planes[side * side + SIDE * SIDE + n] = 128 + (112.439 * r - 94.154 * g - 18.285 * b) / 256;
  }
  return planes;
}

/** @param {number} linear @returns {number} code from 0 to 255 */
function srgb(linear) {
  const value = Math.max(0, Math.min(1, linear));
  return 255 * (value <= 0.0031308 ? 12.92 * value : 1.055 * value ** (1 / 2.4) - 0.055);
}

/** Nearly normal numbers, always the same. */
export function noise() {
  let state = 1;
  const uniform = () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 2 ** 32;
  };
  // The variance of a uniform number is 1/12.
  return () => 2 * (uniform() + uniform() + uniform() - 1.5);
}
