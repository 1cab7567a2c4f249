/**
 * Photographs from video: waits until the picture has changed and is still again, and averages frames.
 *
 * Nothing else tells when a pattern is on the screen and when the camera has seen it: screen, exposure and the browser's
 * buffers delay frames by a time that varies. A frame is linear RGB of each pixel, `[N, 3]`; NaN where a sample is
 * saturated. All waits are counted in frames, as browsers give none while the tab is hidden.
 */

import { PageFault } from '../page-fault.js';

/** Pairs of frames whose difference tells the noise. */
const NOISE_PAIRS = 8;
/** A picture has changed if it differs from the last one by so many times the difference of two still frames. */
const CHANGE_RATIO = 2;
/** Frames count as still up to so many times the difference of two still frames. */
const STILL_RATIO = 1.5;
/** Smallest difference that counts: half a code of dark sRGB. */
const MIN_DIFFERENCE = 1e-4;
/** Still pairs of frames before the average begins: the exposure of a frame may begin under the last pattern. */
const SETTLING_PAIRS = 2;
/** Frames of an average, and of one that a change ends early. */
const MIN_FRAMES = 4;
const MIN_FRAMES_BEFORE_CHANGE = 2;
const MAX_FRAMES = 24;
/** Standard error of a mean that is good enough. 8-bit codes are not more exact. */
const TARGET_ERROR = 1e-3;
/** Frames without a change after which there is no signal: about five seconds. */
const MAX_FRAMES_WITHOUT_CHANGE = 150;
/** Frames of one pattern after which its picture will never be still. */
const MAX_FRAMES_OF_PATTERN = 300;

/** @typedef {{ next(signal: AbortSignal): Promise<Float32Array> }} FrameSource */
/** @typedef {{ photograph: Float32Array, frames: number }} Average */

export class FrameAverager {
  #source;
  /** Mean absolute difference of two frames of a still picture, under full light, where it is largest. */
  #stillDifference = MIN_DIFFERENCE;
  #noise = 0;
  /** @type {Float32Array | undefined} */
  #lastPicture;

  /** @param {FrameSource} source */
  constructor(source) {
    this.#source = source;
  }

  /** Standard deviation of a sample of one frame; that of a mean of `n` frames is smaller by `√n`. */
  get noise() {
    return this.#noise;
  }

  /** Measures the noise of a picture that is still. @param {AbortSignal} signal */
  async measureNoise(signal) {
    let last = await this.#source.next(signal);
    /** @type {number[]} */
    const differences = [];
    for (let i = 0; i < NOISE_PAIRS; i += 1) {
      const frame = await this.#source.next(signal);
      differences.push(meanDifference(last, frame));
      last = frame;
    }
    this.#stillDifference = Math.max(MIN_DIFFERENCE, ...differences);
    // The mean absolute difference of two normal samples is 2σ/√π.
    const mean = differences.reduce((sum, value) => sum + value, 0) / NOISE_PAIRS;
    this.#noise = (mean * Math.sqrt(Math.PI)) / 2;
    this.#lastPicture = last;
  }

  /**
   * Waits until the picture has changed, and averages frames until their noise is low.
   *
   * @param {AbortSignal} signal
   * @returns {Promise<Average>}
   */
  async next(signal) {
    let last = await this.#changed(signal);
    for (let used = 0; used < MAX_FRAMES_OF_PATTERN; ) {
      const settled = await this.#settled(last, MAX_FRAMES_OF_PATTERN - used, signal);
      const { average, next } = await this.#average(settled.frame, signal);
      if (average.frames >= MIN_FRAMES_BEFORE_CHANGE) {
        this.#lastPicture = average.photograph;
        return average;
      }
      used += settled.frames + average.frames;
      last = next;
    }
    throw new PageFault('camera-unstable');
  }

  /** @param {AbortSignal} signal */
  async #changed(signal) {
    for (let frames = 0; frames < MAX_FRAMES_WITHOUT_CHANGE; frames += 1) {
      const frame = await this.#source.next(signal);
      const picture = this.#lastPicture;
      const limit = CHANGE_RATIO * this.#stillDifference;
      if (!picture || meanDifference(picture, frame) > limit) return frame;
    }
    throw new PageFault('camera-no-signal');
  }

  /** @param {Float32Array} first @param {number} most frames @param {AbortSignal} signal */
  async #settled(first, most, signal) {
    let frame = first;
    let [stillPairs, frames] = [0, 0];
    while (stillPairs < SETTLING_PAIRS) {
      if (frames === most) throw new PageFault('camera-unstable');
      const next = await this.#source.next(signal);
      stillPairs = this.#isStill(frame, next) ? stillPairs + 1 : 0;
      frame = next;
      frames += 1;
    }
    return { frame, frames };
  }

  /** Averages frames like the first, until one differs. @param {Float32Array} first @param {AbortSignal} signal @returns {Promise<{ average: Average, next: Float32Array }>} */
  async #average(first, signal) {
    const sum = Float64Array.from(first);
    let [last, frames] = [first, 1];
    while (frames < MAX_FRAMES && !this.#isGood(frames)) {
      const frame = await this.#source.next(signal);
      const isStill = this.#isStill(last, frame);
      last = frame;
      if (!isStill) break;
      for (let i = 0; i < sum.length; i += 1) sum[i] = (sum[i] ?? 0) + (frame[i] ?? 0);
      frames += 1;
    }
    const photograph = Float32Array.from(sum, (value) => value / frames);
    return { average: { photograph, frames }, next: last };
  }

  /** @param {number} frames */
  #isGood(frames) {
    return frames >= MIN_FRAMES && this.#noise / Math.sqrt(frames) < TARGET_ERROR;
  }

  /** @param {Float32Array} a @param {Float32Array} b */
  #isStill(a, b) {
    return meanDifference(a, b) < STILL_RATIO * this.#stillDifference;
  }
}

/** Mean absolute difference of the samples that neither frame has saturated. @param {Float32Array} a @param {Float32Array} b */
function meanDifference(a, b) {
  let [sum, count] = [0, 0];
  for (let i = 0; i < a.length; i += 1) {
    const difference = Math.abs((a[i] ?? 0) - (b[i] ?? 0));
    if (Number.isNaN(difference)) continue;
    sum += difference;
    count += 1;
  }
  return count === 0 ? 0 : sum / count;
}
