/** Shows all patterns one after the other, and photographs each of them. */

import { PageFault } from '../page-fault.js';
import { FrameAverager } from './frame-averager.js';

/** Frames in which automatic settings adapt to full light before they are fixed. */
const ADAPTING_FRAMES = 12;
/** Frames after which a new exposure is surely in effect. */
const EXPOSURE_FRAMES = 6;
/** Largest share of saturated samples under full light. */
const MAX_SATURATED_SHARE = 0.02;

/** @typedef {import('./camera.js').AutomaticSetting} AutomaticSetting */
/** @typedef {import('./capture-files.js').PatternPhotograph} PatternPhotograph */
/** @typedef {import('./light-patterns.js').LightPattern} LightPattern */
/** @typedef {{ next(signal: AbortSignal): Promise<Float32Array>, lock(): Promise<AutomaticSetting[]>, darken(): Promise<boolean> }} PatternCamera */
/** @typedef {{ show(codes: Uint8Array): void }} PatternScreen */
/** @typedef {{ noise: number, frames: number, unlocked: AutomaticSetting[] }} Quality noise of one frame, and frames of the pattern with the fewest */

/**
 * @param {{ camera: PatternCamera, screen: PatternScreen, patterns: LightPattern[] }} rig
 * @param {{ signal: AbortSignal, onPhotograph: (photograph: PatternPhotograph) => void }} options
 * @returns {Promise<Quality>}
 */
export async function photographPatterns({ camera, screen, patterns }, { signal, onPhotograph }) {
  const flood = patterns.find(({ kind }) => kind === 'flood');
  if (!flood) throw new Error('there is no pattern with full light');
  screen.show(flood.codes);
  await skip(camera, ADAPTING_FRAMES, signal);
  const unlocked = await camera.lock();
  await avoidSaturation(camera, signal);
  const averager = new FrameAverager(camera);
  await averager.measureNoise(signal);
  let frames = Number.POSITIVE_INFINITY;
  for (const pattern of patterns) {
    screen.show(pattern.codes);
    const average = await averager.next(signal);
    frames = Math.min(frames, average.frames);
    onPhotograph({ pattern, photograph: average.photograph });
  }
  return { noise: averager.noise, frames, unlocked };
}

/** Darkens the exposure until full light saturates few samples. @param {PatternCamera} camera @param {AbortSignal} signal */
async function avoidSaturation(camera, signal) {
  for (;;) {
    const frame = await camera.next(signal);
    const share = frame.filter(Number.isNaN).length / frame.length;
    if (share <= MAX_SATURATED_SHARE) return;
    if (!(await camera.darken())) {
      throw new PageFault('camera-saturated', { percent: Math.ceil(100 * share) });
    }
    await skip(camera, EXPOSURE_FRAMES, signal);
  }
}

/** @param {PatternCamera} camera @param {number} frames @param {AbortSignal} signal */
async function skip(camera, frames, signal) {
  for (let i = 0; i < frames; i += 1) await camera.next(signal);
}
