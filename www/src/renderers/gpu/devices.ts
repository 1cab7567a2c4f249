/**
 * The graphics devices of a page: one of each kind, which all photographs share, and which goes with the
 * last of them. One that is lost is made anew for who asks next, unless it is lost again and again.
 */

import type { Backend, Graphics, Modules } from '../../engine/types.js';
import { PhotoError } from '../../shared/errors.js';

/** A back end that is a graphics device. */
export type GraphicsBackend = Exclude<Backend, 'cpu'>;

/** Gives the modules of devices. */
export type LoadGraphics = <N extends GraphicsBackend>(name: N) => Promise<Modules[N]>;

/** What of the page is used. */
export interface Page {
  /** What a device calls itself; `null` where there is none. A module that has none to drive is not loaded. */
  nameOf(backend: GraphicsBackend): Promise<string | null>;
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

/** Programs that make up for a missing graphics processor. */
const PROGRAMS = /swiftshader|llvmpipe|lavapipe|softpipe|basic render|software/i;

/** See the module. */
export class Devices {
  readonly #page: Page;
  readonly #longestMs: number;
  readonly #shared = new Map<GraphicsBackend, Shared>();
  /** What devices call themselves, once asked. */
  readonly #names = new Map<GraphicsBackend, Promise<string | null>>();
  /** Why WebGPU, which never answered, is not asked again. */
  #mute: PhotoError | null = null;
  readonly #losses = new Map<GraphicsBackend, { count: number; last: number }>();

  constructor(page: Page = thisPage(), longestMs = LONGEST_MS) {
    this.#page = page;
    this.#longestMs = longestMs;
  }

  /**
   * A share of a device, until it is released; `software`: also of one that is a program. `lost` is told at
   * most once. Rejects with `backend-unavailable` where there is none to have, or has been too often.
   */
  async lease(
    load: LoadGraphics,
    backend: GraphicsBackend,
    software: boolean,
    lost: (reason: string) => void,
  ): Promise<Lease> {
    if (backend === 'webgpu' && this.#mute) throw this.#mute;
    this.#refuseFickle(backend);
    const name = await this.#nameOf(backend);
    if (name === null) throw unavailable('this browser has none to offer');
    if (!software && PROGRAMS.test(name)) {
      throw unavailable(`it is done by a program here (${name}), and the CPU is faster`);
    }
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

  #nameOf(backend: GraphicsBackend): Promise<string | null> {
    let name = this.#names.get(backend);
    if (!name) {
      name = this.#answered(this.#page.nameOf(backend), () => {});
      this.#names.set(backend, name);
      // One that there is none of may be there later: a driver starts anew.
      const forget = () => this.#names.delete(backend);
      name.then((known) => known ?? forget(), forget);
    }
    return name;
  }

  async #webGpu(load: LoadGraphics): Promise<Graphics> {
    const { Graphics } = await load('webgpu');
    return await this.#answered(Graphics.webgpu(), (device) => device.free());
  }

  /** What is asked of WebGPU; `late` is given what comes when nobody waits for it any more. */
  async #answered<T>(asked: Promise<T>, late: (answer: T) => void): Promise<T> {
    let timer: ReturnType<typeof setTimeout> | undefined;
    const tooLate = new Promise<never>((_, reject) => {
      timer = setTimeout(() => {
        const why = `it does not answer within ${this.#longestMs / 1000} seconds`;
        // Else each photograph would wait as long.
        this.#mute = unavailable(why);
        reject(this.#mute);
        asked.then(
          (answer) => {
            // A page that slept, say.
            this.#mute = null;
            late(answer);
          },
          () => {},
        );
      }, this.#longestMs);
    });
    try {
      return await Promise.race([asked, tooLate]);
    } finally {
      clearTimeout(timer);
    }
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
    // What comes in its place may be a program.
    this.#names.delete(backend);
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

/** What is used of WebGPU here, which types of browsers do not tell of yet. */
interface Gpu {
  requestAdapter(): Promise<{ readonly info?: AdapterInfo } | null>;
}
interface AdapterInfo {
  readonly vendor?: string;
  readonly architecture?: string;
  readonly description?: string;
  readonly isFallbackAdapter?: boolean;
}

async function webGpuName(): Promise<string | null> {
  const adapter = await (navigator as { gpu?: Gpu }).gpu?.requestAdapter();
  if (!adapter) return null;
  const { vendor, architecture, description, isFallbackAdapter } = adapter.info ?? {};
  return [vendor, architecture, description, isFallbackAdapter ? 'software' : ''].join(' ').trim();
}

function webGl2Name(): string | null {
  const gl = document.createElement('canvas').getContext('webgl2');
  if (!gl) return null;
  let name: string | null = gl.getParameter(gl.RENDERER);
  // Some browsers tell only who asks twice; others complain of that.
  if (name?.startsWith('WebKit')) {
    const info = gl.getExtension('WEBGL_debug_renderer_info');
    if (info) name = gl.getParameter(info.UNMASKED_RENDERER_WEBGL);
  }
  // Browsers let pages have a few contexts only.
  gl.getExtension('WEBGL_lose_context')?.loseContext();
  return name;
}

function thisPage(): Page {
  return {
    nameOf: async (backend) => (backend === 'webgpu' ? webGpuName() : webGl2Name()),
    newCanvas: () => document.createElement('canvas'),
    now: () => performance.now(),
  };
}
