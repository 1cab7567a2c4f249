/** A device that is tilted, as light: where it is held to begin with, the light is in the middle. */

import { clampToPicture, type PicturePoint } from '../shared/values.js';

/** How a device is held, in degrees, as `deviceorientation` tells it. */
export interface Pose {
  /** Front to back. */
  readonly beta: number;
  /** Left to right. */
  readonly gamma: number;
}

/** So many degrees to a side take the light to the picture's edge. */
const REACH = 25;
/** Of what is new in each event: hands tremble. */
const SHARE = 0.25;

/** See the module. */
export class Tilt {
  #rest: Pose | null = null;
  #at: PicturePoint = { x: 0.5, y: 0.5 };

  /** Where the light is, with the screen turned by so many degrees. */
  turn({ beta, gamma }: Pose, screenAngle: number): PicturePoint {
    this.#rest ??= { beta, gamma };
    const right = difference(gamma, this.#rest.gamma, 180);
    const down = difference(beta, this.#rest.beta, 360);
    const angle = (screenAngle * Math.PI) / 180;
    const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
    const x = 0.5 + (right * cos + down * sin) / (2 * REACH);
    const y = 0.5 + (down * cos - right * sin) / (2 * REACH);
    const { x: toX, y: toY } = clampToPicture({ x, y });
    const from = this.#at;
    this.#at = { x: from.x + SHARE * (toX - from.x), y: from.y + SHARE * (toY - from.y) };
    return this.#at;
  }
}

/** The short way round. */
function difference(to: number, from: number, round: number): number {
  const turned = (((to - from) % round) + round) % round;
  return turned > round / 2 ? turned - round : turned;
}

/** Tells where the light is each time that the device is held in another way. */
export function followTilt(tell: (point: PicturePoint) => void, signal: AbortSignal): void {
  const tilt = new Tilt();
  const turn = ({ beta, gamma }: DeviceOrientationEvent) => {
    // Machines on a table have none.
    if (beta === null || gamma === null) return;
    tell(tilt.turn({ beta, gamma }, screen.orientation?.angle ?? 0));
  };
  if (!signal.aborted) addEventListener('deviceorientation', turn, { signal });
}
