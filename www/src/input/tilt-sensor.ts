/** A device's tilt, where there is such a thing and the visitor allows it. */

import type { PicturePoint } from '../shared/values.js';

/** Some browsers ask the visitor. */
type Asking = { requestPermission?: () => Promise<string> };

/** Whether a device is likely to tell how it is held: one for the hand. */
export function mayTilt(): boolean {
  return 'DeviceOrientationEvent' in globalThis && matchMedia('(pointer: coarse)').matches;
}

/** See the module. */
export class Tilting {
  readonly #tell: (point: PicturePoint) => void;
  #listening: AbortController | null = null;

  constructor(tell: (point: PicturePoint) => void) {
    this.#tell = tell;
  }

  get on(): boolean {
    return this.#listening !== null;
  }

  /** Begins, from how the device is held now. Gives whether it may. */
  async request(): Promise<boolean> {
    const events = (globalThis as { DeviceOrientationEvent?: Asking }).DeviceOrientationEvent;
    if (!events) return false;
    try {
      const answer = (await events.requestPermission?.()) ?? 'granted';
      if (answer !== 'granted') return false;
    } catch {
      // Not asked by a press of the visitor's.
      return false;
    }
    this.stop();
    const listening = new AbortController();
    this.#listening = listening;
    try {
      // A script of its own, and after the question: browsers let it be asked by a press only.
      const { followTilt } = await import('./tilt.js');
      followTilt(this.#tell, listening.signal);
    } catch {
      if (this.#listening === listening) this.stop();
    }
    return !listening.signal.aborted;
  }

  stop(): void {
    this.#listening?.abort();
    this.#listening = null;
  }
}
