/**
 * The page's graphics devices: one per graphics backend, shared by all photographs and freed with the last of them. The
 * next lease after a loss gets a new device, unless losses are frequent.
 */

import type { GraphicsDevice, GraphicsModules } from '../../engine/wasm-exports.js';
import { PhotoError } from '../../shared/errors.js';
import { withTimeout } from '../../shared/promises.js';
import type { BackendPreferences } from '../types.js';
import {
  BROWSER_GRAPHICS,
  type GraphicsBackendName,
  type GraphicsPorts,
} from './graphics-ports.js';

export type LoadGraphics = <N extends GraphicsBackendName>(name: N) => Promise<GraphicsModules[N]>;

export type DevicePreferences = Pick<BackendPreferences, 'backends' | 'software'>;

/** A photograph's use of a device. Free its relighter before `release`. */
export interface DeviceLease {
  readonly graphics: GraphicsDevice;
  /** Reports that the device does not work. */
  fail(reason: string): void;
  release(): void;
}

/** A question to the browser. */
interface Request<T> {
  readonly answer: Promise<T>;
  readonly askedMs: number;
}

/** A device that is open or being opened. */
interface SharedDevice {
  readonly graphics: Request<GraphicsDevice>;
  readonly holders: Set<(reason: string) => void>;
  /** Lost or freed: later events of the device are ignored. */
  isClosed: boolean;
}

/** After this many losses, with less than `LOSS_MEMORY_MS` between two of them, leases are refused. */
const MAX_LOSSES = 3;
const LOSS_MEMORY_MS = 60_000;
/** Some browsers never answer a request for WebGPU. Then the next backend is tried. */
const MAX_ANSWER_MS = 10_000;
/** The limit where no other backend is left: a software renderer on a busy machine is slow to open. */
const MAX_LAST_ANSWER_MS = 60_000;

const SOFTWARE_RENDERERS = /swiftshader|llvmpipe|lavapipe|softpipe|basic render|software/i;

export class Devices {
  readonly #devices = new Map<GraphicsBackendName, SharedDevice>();
  /** The names of adapters, once requested. */
  readonly #names = new Map<GraphicsBackendName, Request<string | null>>();
  readonly #losses = new Map<GraphicsBackendName, { count: number; lastMs: number }>();

  constructor(
    private readonly ports: GraphicsPorts = BROWSER_GRAPHICS,
    private readonly maxAnswerMs = MAX_ANSWER_MS,
    private readonly maxLastAnswerMs = MAX_LAST_ANSWER_MS,
  ) {}

  /**
   * `onLost` is called at most once. Rejects with `backend-unavailable`, and with the reason of `signal`. A request that the
   * browser leaves unanswered is not repeated: the next lease waits as long as is left of its limit.
   */
  async lease(
    load: LoadGraphics,
    backend: GraphicsBackendName,
    { backends, software }: DevicePreferences,
    onLost: (reason: string) => void,
    signal?: AbortSignal,
  ): Promise<DeviceLease> {
    this.#checkLosses(backend);
    const isLast = backends.at(-1) === backend;
    const maxMs = isLast ? this.maxLastAnswerMs : this.maxAnswerMs;
    const name = await this.#untilAnswered(this.#nameOf(backend), maxMs, signal);
    if (name === null) throw unavailable('this browser has no device for it');
    if (!software && SOFTWARE_RENDERERS.test(name)) {
      throw unavailable(`its device is a software renderer (${name}), and the CPU is faster`);
    }
    // The time limit is for the browser's answer, not for the download.
    await load(backend);
    const device = this.#devices.get(backend) ?? this.#open(load, backend);
    // A new function for each lease, since a caller may pass the same one twice.
    const holder = (reason: string): void => onLost(reason);
    device.holders.add(holder);
    const release = (): void => {
      device.holders.delete(holder);
      if (device.holders.size === 0) this.#close(backend, device);
    };
    try {
      const fail = (reason: string): void => this.#lose(backend, device, reason);
      const graphics = await this.#untilAnswered(device.graphics, maxMs, signal);
      return { graphics, fail, release };
    } catch (thrown) {
      device.holders.delete(holder);
      // By then it may be in use by others.
      const closeUnused = (): void => {
        if (device.holders.size === 0) this.#close(backend, device);
      };
      device.graphics.answer.then(closeUnused, closeUnused);
      throw thrown;
    }
  }

  #checkLosses(backend: GraphicsBackendName): void {
    const losses = this.#losses.get(backend);
    if (!losses || this.ports.now() - losses.lastMs > LOSS_MEMORY_MS) return;
    if (losses.count >= MAX_LOSSES) {
      throw unavailable(`it was lost ${losses.count} times within a short time`);
    }
  }

  #open(load: LoadGraphics, backend: GraphicsBackendName): SharedDevice {
    const lose = (reason: string): void => this.#lose(backend, device, reason);
    const answer = backend === 'webgpu' ? this.#openWebGpu(load) : this.#openWebGl2(load, lose);
    const graphics = { answer, askedMs: this.ports.now() };
    const device: SharedDevice = { graphics, holders: new Set(), isClosed: false };
    this.#devices.set(backend, device);
    answer.then(
      ({ lost }) => lost?.then(({ message }) => lose(message || 'the graphics device is gone.')),
      () => {}, // `lease` rejects with it
    );
    return device;
  }

  #nameOf(backend: GraphicsBackendName): Request<string | null> {
    const known = this.#names.get(backend);
    if (known) return known;
    const answer = this.ports.nameOf(backend);
    const name = { answer, askedMs: this.ports.now() };
    this.#names.set(backend, name);
    // A device that is missing now may come back, with a restarted driver.
    const forget = () => this.#names.delete(backend);
    answer.then((found) => found ?? forget(), forget);
    return name;
  }

  async #openWebGpu(load: LoadGraphics): Promise<GraphicsDevice> {
    const { GraphicsDevice } = await load('webgpu');
    return await GraphicsDevice.webgpu();
  }

  /** Waits for an answer until `maxMs` after the question. */
  #untilAnswered<T>(
    { answer, askedMs }: Request<T>,
    maxMs: number,
    signal?: AbortSignal,
  ): Promise<T> {
    const ms = Math.max(0, askedMs + maxMs - this.ports.now());
    const onTimeout = () =>
      Promise.reject(unavailable(`it does not answer within ${maxMs / 1000} seconds`));
    return withTimeout(answer, { ...(signal && { signal }), ms, onTimeout });
  }

  async #openWebGl2(load: LoadGraphics, lose: (reason: string) => void): Promise<GraphicsDevice> {
    const { GraphicsDevice } = await load('webgl2');
    const canvas = this.ports.createCanvas();
    const graphics = GraphicsDevice.webgl2(canvas);
    canvas.addEventListener('webglcontextlost', () => lose('the browser took it away.'));
    return graphics;
  }

  #lose(backend: GraphicsBackendName, device: SharedDevice, reason: string): void {
    if (device.isClosed) return;
    const losses = this.#losses.get(backend) ?? { count: 0, lastMs: 0 };
    const now = this.ports.now();
    const isRecent = now - losses.lastMs <= LOSS_MEMORY_MS;
    this.#losses.set(backend, { count: isRecent ? losses.count + 1 : 1, lastMs: now });
    // The next device may be a software renderer.
    this.#names.delete(backend);
    const holders = [...device.holders];
    this.#close(backend, device);
    for (const onLost of holders) onLost(reason);
  }

  #close(backend: GraphicsBackendName, device: SharedDevice): void {
    if (device.isClosed) return;
    device.isClosed = true;
    if (this.#devices.get(backend) === device) this.#devices.delete(backend);
    device.graphics.answer.then(
      (graphics) => graphics.free(),
      () => {},
    );
  }
}

/** The session puts the backend's name and a colon before the message. */
function unavailable(message: string): PhotoError {
  return new PhotoError('backend-unavailable', message);
}
