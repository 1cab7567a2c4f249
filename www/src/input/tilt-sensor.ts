/** Asks for permission to read the device's orientation, and moves the torch by it. */

import type { PicturePoint } from '../shared/value-types.js';
import { observeTilt } from './tilt.js';

/** Whether the device is likely to have an orientation sensor: handheld devices. */
export function isTiltSupported(): boolean {
  return 'DeviceOrientationEvent' in globalThis && matchMedia('(pointer: coarse)').matches;
}

export class TiltSensor {
  #listening: AbortController | null = null;
  /** The last request, which may wait for the visitor. */
  #request: AbortController | null = null;

  constructor(private readonly moveTorch: (point: PicturePoint) => void) {}

  get isActive(): boolean {
    return this.#listening !== null;
  }

  /** Starts; the current orientation is neutral. Resolves to whether permission was granted. */
  async request(): Promise<boolean> {
    // Some browsers ask the visitor for permission.
    const { DeviceOrientationEvent: type } = globalThis as {
      DeviceOrientationEvent?: { requestPermission?: () => Promise<string> };
    };
    if (!type) return false;
    this.#request?.abort();
    const listening = new AbortController();
    this.#request = listening;
    try {
      const permission = (await type.requestPermission?.()) ?? 'granted';
      if (permission !== 'granted') return false;
    } catch {
      // The browser asks only after a press.
      return false;
    }
    // Stopped while the visitor was asked.
    if (listening.signal.aborted) return false;
    this.#listening?.abort();
    this.#listening = listening;
    observeTilt(this.moveTorch, listening.signal);
    return true;
  }

  stop(): void {
    this.#request?.abort();
    this.#request = null;
    this.#listening?.abort();
    this.#listening = null;
  }
}
