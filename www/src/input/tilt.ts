/** Maps the device's orientation to the torch's position. The initial orientation is the centre of the picture. */

import { CENTRE, clampToPicture, type PicturePoint } from '../shared/value-types.js';

/** In degrees, as in a `deviceorientation` event. */
export interface DeviceAngles {
  readonly beta: number;
  readonly gamma: number;
}

/** The tilt that moves the torch from the centre to the edge. */
const EDGE_DEGREES = 25;
/** Weight of a new event in the exponential average, which smooths the tremor of hands. */
const SMOOTHING = 0.25;

export class TiltTracker {
  #neutral: DeviceAngles | null = null;
  #position: PicturePoint = CENTRE;

  /** The torch's position, for a screen that is rotated by `screenAngle` degrees. */
  update({ beta, gamma }: DeviceAngles, screenAngle: number): PicturePoint {
    this.#neutral ??= { beta, gamma };
    const right = angleDifference(gamma, this.#neutral.gamma, 180);
    const down = angleDifference(beta, this.#neutral.beta, 360);
    const angle = (screenAngle * Math.PI) / 180;
    const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
    const target = clampToPicture({
      x: 0.5 + (right * cos + down * sin) / (2 * EDGE_DEGREES),
      y: 0.5 + (down * cos - right * sin) / (2 * EDGE_DEGREES),
    });
    const { x, y } = this.#position;
    this.#position = { x: x + SMOOTHING * (target.x - x), y: y + SMOOTHING * (target.y - y) };
    return this.#position;
  }
}

/** `a − b` the short way round, for angles with the given period. */
function angleDifference(a: number, b: number, period: number): number {
  const difference = (((a - b) % period) + period) % period;
  return difference > period / 2 ? difference - period : difference;
}

/** Calls back with the torch's position at each change of the device's orientation. */
export function observeTilt(moveTorch: (point: PicturePoint) => void, signal: AbortSignal): void {
  const tracker = new TiltTracker();
  const update = ({ beta, gamma }: DeviceOrientationEvent) => {
    // Devices without a sensor report null.
    if (beta === null || gamma === null) return;
    moveTorch(tracker.update({ beta, gamma }, screen.orientation?.angle ?? 0));
  };
  addEventListener('deviceorientation', update, { signal });
}
