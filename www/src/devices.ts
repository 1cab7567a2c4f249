/**
 * The graphics devices of a page: one of each kind, which all photographs share, and which goes with the
 * last of them. One that is lost is made anew for who asks next, unless it is lost again and again.
 */

import { BACKEND_TITLES } from './backends.js';
import type { Backend, Graphics, Modules } from './engine.js';
import { PhotoError } from './errors.js';

/** A back end that is a graphics device. */
export type GraphicsBackend = Exclude<Backend, 'cpu'>;

/** Gives the modules of devices. */
export type LoadGraphics = <N extends GraphicsBackend>(name: N) => Promise<Modules[N]>;

/** What of the page is used. */
export interface Page {
  /** Whether there is a WebGPU adapter: a module that has none to drive need not be loaded. */
  hasWebGpu(): Promise<boolean>;
  newCanvas(): HTMLCanvasElement;
  now(): number;
}

/** A photograph's share of a device. */
export interface Lease {
  readonly graphics: Graphics;
  /** Tells that the device does not work, where the browser did not. */
  fail(reason: string): void;
  /** Gives the share up; what was drawn by is to be freed before. */
  release(): void;
}

/** A device, or one that is on its way. */
interface Shared {
  readonly graphics: Promise<Graphics>;
  /** Told when the device is lost. */
  readonly holders: Set<(reason: string) => void>;
  /** Whether it was lost or let go: what it says after that is nobody's concern. */
  over: boolean;
}

/** After so many losses with less than the time below between, a device is done without. */
const MOST_LOSSES = 3;
const FORGET_MS = 60_000;
/** Where a device takes longer, none is to be expected: some browsers never answer. */
const LONGEST_MS = 10_000;

/** See the module. */
export class Devices {
  readonly #page: Page;
  readonly #longestMs: number;
  readonly #shared = new Map<GraphicsBackend, Shared>();
  /** Those that never answered, and why they are not asked again. */
  readonly #mute = new Map<GraphicsBackend, PhotoError>();
  readonly #losses = new Map<GraphicsBackend, { count: number; last: number }>();

  constructor(page: Page = thisPage(), longestMs = LONGEST_MS) {
    this.#page = page;
    this.#longestMs = longestMs;
  }

  /**
   * A share of a device, until it is released. `lost` is told at most once. Rejects with
   * `backend-unavailable` where there is none to have, or has been too often.
   */
  async lease(
    load: LoadGraphics,
    backend: GraphicsBackend,
    lost: (reason: string) => void,
  ): Promise<Lease> {
    const mute = this.#mute.get(backend);
    if (mute) throw mute;
    this.#refuseFickle(backend);
    const shared = this.#shared.get(backend) ?? this.#open(load, backend);
    // One function may hold several shares.
    const holder = (reason: string): void => lost(reason);
    shared.holders.add(holder);
    const release = (): void => {
      shared.holders.delete(holder);
      if (shared.holders.size === 0) this.#close(backend, shared);
    };
    try {
      const fail = (reason: string): void => this.#lose(backend, shared, reason);
      return { graphics: await shared.graphics, fail, release };
    } catch (thrown) {
      release();
      throw thrown;
    }
  }

  #refuseFickle(backend: GraphicsBackend): void {
    const losses = this.#losses.get(backend);
    if (!losses || losses.count < MOST_LOSSES) return;
    if (this.#page.now() - losses.last > FORGET_MS) {
      this.#losses.delete(backend);
      return;
    }
    throw unavailable(`it was lost ${losses.count} times within a short time`);
  }

  #open(load: LoadGraphics, backend: GraphicsBackend): Shared {
    const lose = (reason: string): void => this.#lose(backend, shared, reason);
    const graphics = backend === 'webgpu' ? this.#webGpu(load) : this.#webGl2(load, lose);
    const shared: Shared = { graphics, holders: new Set(), over: false };
    this.#shared.set(backend, shared);
    graphics.then(
      (device) => {
        void device.lost?.then(({ message }) => lose(message || 'the graphics device is gone.'));
      },
      () => {}, // told to who asked
    );
    return shared;
  }

  async #webGpu(load: LoadGraphics): Promise<Graphics> {
    let timer: ReturnType<typeof setTimeout> | undefined;
    const asked = this.#askWebGpu(load);
    const late = new Promise<never>((_, reject) => {
      const why = `it does not answer within ${this.#longestMs / 1000} seconds`;
      timer = setTimeout(() => {
        const error = unavailable(why);
        // Else each photograph would wait as long.
        this.#mute.set('webgpu', error);
        reject(error);
        asked.then(
          (device) => {
            this.#mute.delete('webgpu');
            device.free();
          },
          () => {},
        );
      }, this.#longestMs);
    });
    try {
      return await Promise.race([asked, late]);
    } finally {
      clearTimeout(timer);
    }
  }

  async #askWebGpu(load: LoadGraphics): Promise<Graphics> {
    if (!(await this.#page.hasWebGpu())) throw unavailable('this browser has none to offer');
    return await (await load('webgpu')).Graphics.webgpu();
  }

  async #webGl2(load: LoadGraphics, lose: (reason: string) => void): Promise<Graphics> {
    const { Graphics } = await load('webgl2');
    const canvas = this.#page.newCanvas();
    const graphics = Graphics.webgl2(canvas);
    canvas.addEventListener('webglcontextlost', () => lose('the browser took it away.'));
    return graphics;
  }

  #lose(backend: GraphicsBackend, shared: Shared, reason: string): void {
    if (shared.over) return;
    const losses = this.#losses.get(backend) ?? { count: 0, last: 0 };
    const now = this.#page.now();
    const recent = now - losses.last <= FORGET_MS;
    this.#losses.set(backend, { count: recent ? losses.count + 1 : 1, last: now });
    const holders = [...shared.holders];
    this.#close(backend, shared);
    for (const lost of holders) lost(reason);
  }

  #close(backend: GraphicsBackend, shared: Shared): void {
    if (shared.over) return;
    shared.over = true;
    if (this.#shared.get(backend) === shared) this.#shared.delete(backend);
    shared.graphics.then(
      (device) => device.free(),
      () => {},
    );
  }
}

/** For errors of devices, whatever the module says of them. */
export function unavailable(why: string, cause?: unknown): PhotoError {
  return new PhotoError('backend-unavailable', why, cause);
}

/** That a device is a program. */
export function slowerThanCpu(backend: GraphicsBackend, kernel: string): PhotoError {
  const why = `${BACKEND_TITLES[backend]} is done by a program here (${kernel}), and the CPU is faster`;
  return unavailable(why);
}

function thisPage(): Page {
  return {
    hasWebGpu: async () => {
      const { gpu } = navigator as { gpu?: { requestAdapter(): Promise<unknown> } };
      return Boolean(await gpu?.requestAdapter());
    },
    newCanvas: () => document.createElement('canvas'),
    now: () => performance.now(),
  };
}
