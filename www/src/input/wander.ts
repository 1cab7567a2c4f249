/** The path of a torch that wanders by itself: a Lissajous curve around the centre of the picture. */

import { CENTRE, type PicturePoint } from '../shared/value-types.js';

/** One horizontal period: slow enough for the eye to rest on the light. */
const PERIOD_SECONDS = 16;
/** Amplitude, as a fraction of the picture. */
const AMPLITUDE = { x: 0.3, y: 0.26 };
/** An irrational ratio of the frequencies keeps the path from repeating. */
const FREQUENCY_RATIO = 0.618;
const PHASE = 0.9;
/** The time in which the torch moves from its start onto the curve. */
const EASE_SECONDS = 3;

/** The position `seconds` after the torch left the point `start`. */
export function wander(start: PicturePoint, seconds: number): PicturePoint {
  const angle = (2 * Math.PI * seconds) / PERIOD_SECONDS;
  const x = CENTRE.x + AMPLITUDE.x * Math.sin(angle);
  const y = CENTRE.y + AMPLITUDE.y * Math.sin(FREQUENCY_RATIO * angle + PHASE);
  const t = Math.min(1, seconds / EASE_SECONDS);
  const eased = t * t * (3 - 2 * t);
  return { x: start.x + eased * (x - start.x), y: start.y + eased * (y - start.y) };
}
