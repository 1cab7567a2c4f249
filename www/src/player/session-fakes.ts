/** A photo session whose loads, renderers and frames are controlled by a test. */

import type { Backend } from '../engine/wasm-exports.js';
import type { PhotoUser } from '../photo/photo-library.js';
import type { LoadedPhotograph } from '../photo/photograph.js';
import { RefCounted } from '../photo/ref-counted.js';
import { QualityController } from '../renderers/quality-controller.js';
import { withBackends, withExposure } from '../renderers/settings-fakes.js';
import type { Renderer } from '../renderers/types.js';
import { PhotoError } from '../shared/errors.js';
import { PhotoSession } from './photo-session.js';
import type { SessionSettings } from './types.js';

export const SETTINGS: SessionSettings = {
  src: 'a.ltm',
  credentials: 'same-origin',
  backendOptions: withBackends(['webgpu', 'cpu']),
  light: { name: 'flood', torch: null, image: null },
  output: withExposure(1),
};

/** Lets every promise that can settle do so. */
export const settle = () => new Promise((resolve) => setImmediate(resolve));

/** A frame in progress. */
interface SlowFrame {
  done(lightError?: PhotoError | null): void;
  fail(error: Error): void;
}

function fakePhotograph(src: string, completeness: number, log: string[]): LoadedPhotograph {
  const name = completeness === 1 ? src : `${completeness} of ${src}`;
  const isComplete = completeness === 1;
  return {
    completeness,
    isComplete,
    free: () => log.push(`free ${name}`),
  } as unknown as LoadedPhotograph;
}

/** A session whose listener writes a log. */
export function fakeSession() {
  const log: string[] = [];
  const losses: string[] = [];
  const opens = new Map<
    string,
    { preview(completeness: number): void; resolve(): void; reject(error: Error): void }
  >();
  /** The sessions that have a photograph or wait for one. */
  const users = new Set<PhotoUser>();
  /** The renderers that were requested. */
  const requests: {
    backend: Backend;
    resolve(): void;
    reject(error: Error): void;
    lose(reason: string): void;
  }[] = [];
  const frames: (() => void)[] = [];
  const timers = new Map<() => void, number>();
  let now = 0;
  /** Duration of a frame in full quality, which blocks the page. */
  let frameMs = 0;
  let isLostAtFrame = false;
  let lightError: PhotoError | null = null;
  /** The frames in progress; `null` while frames are drawn at once. */
  let slowFrames: SlowFrame[] | null = null;
  const session = new PhotoSession(
    {
      library: {
        open: (address, user, signal) =>
          new Promise((resolve, reject) => {
            const src = String(address.src);
            users.add(user);
            const onAbort = () => log.push(`abort ${src}`);
            signal.addEventListener('abort', onAbort);
            signal.addEventListener('abort', () => users.delete(user));
            opens.set(src, {
              preview: (completeness) => {
                if (!user.wantsPreviews) return;
                const preview = new RefCounted(fakePhotograph(src, completeness, log));
                user.preview(preview);
                preview.release();
              },
              resolve: () => {
                signal.removeEventListener('abort', onAbort);
                resolve(new RefCounted(fakePhotograph(src, 1, log)));
              },
              reject: (error) => {
                signal.removeEventListener('abort', onAbort);
                reject(error);
              },
            });
          }),
        update: () => {},
      },
      copyCanvas: ({ canvas }) => {
        log.push('copy');
        return canvas;
      },
      prepare: () => {},
      createRenderer: (backend, _photo, options, onLost) =>
        new Promise((resolve, reject) => {
          const renderer: Renderer = {
            kernel: 'fake',
            gamut: options.gamut,
            qualityController: new QualityController(),
            canvas: {} as HTMLCanvasElement,
            render: ({ name }, _output, quality) => {
              if (isLostAtFrame) throw new PhotoError('backend-lost', 'the device is gone.');
              log.push(`${backend} draws ${name}${quality < 1 ? ` with ${quality}` : ''}`);
              now += frameMs * quality;
              const pending = slowFrames;
              if (!pending) return { lightApplied: !lightError, lightError };
              return new Promise((done, fail) =>
                pending.push({
                  done: (error = null) => done({ lightApplied: !error, lightError: error }),
                  fail,
                }),
              );
            },
            free: () => log.push(`free ${backend}`),
          };
          requests.push({ backend, resolve: () => resolve(renderer), reject, lose: onLost });
        }),
      nextFrame: (callback) => frames.push(callback),
      callLater: (ms, callback) => {
        timers.set(callback, now + ms);
        return () => timers.delete(callback);
      },
      now: () => now,
    },
    {
      placement: 0,
      loadStarted: () => log.push('loading'),
      progress: () => {},
      frameDrawn: (frame) => frame.lightError && log.push(`no light: ${frame.lightError.message}`),
      qualityChanged: (quality) => log.push(`quality ${quality}`),
      loaded: () => log.push('loaded'),
      rendererChanged: () => {},
      backendLost: (backend, reason) => losses.push(`${backend}: ${reason}`),
      backendChanged: (backend, previous, reason) =>
        log.push(`backend ${previous} -> ${backend}${reason && ` (${reason})`}`),
      failed: (error) => log.push(`failed ${error.code}: ${error.message}`),
      warned: (error) => log.push(`warned ${error.code}: ${error.message}`),
      recovered: () => log.push('recovered'),
    },
  );
  return {
    session,
    /** The losses that the listener was told. */
    losses,
    requests,
    users,
    /** The callbacks that wait for the browser's next frame. */
    frames,
    /** The log since the last call. */
    takeLog: () => log.splice(0),
    async finishLoad(src: string) {
      opens.get(src)?.resolve();
      await settle();
    },
    async sendPreview(src: string, completeness: number) {
      opens.get(src)?.preview(completeness);
      await settle();
    },
    async failLoad(src: string, error: Error) {
      opens.get(src)?.reject(error);
      await settle();
    },
    async createRenderer(index: number) {
      requests[index]?.resolve();
      await settle();
    },
    async failRenderer(index: number, message: string, code = 'backend-unavailable') {
      requests[index]?.reject(new PhotoError(code, message));
      await settle();
    },
    /** The device of that renderer is lost. */
    lose: (index: number, reason: string) => requests[index]?.lose(reason),
    /** Frames take time from now on; the test ends them. */
    slowDown() {
      slowFrames = [];
      return slowFrames;
    },
    /** The browser's next frame. `page` runs before the session's callbacks. */
    async frame(page = () => {}) {
      const callbacks = frames.splice(0);
      page();
      for (const callback of callbacks) callback();
      await settle();
    },
    async pass(ms: number) {
      now += ms;
      for (const [callback, dueMs] of timers) {
        if (dueMs <= now && timers.delete(callback)) callback();
      }
      await settle();
    },
    setFrameMs(ms: number) {
      frameMs = ms;
    },
    setLightError(error: PhotoError | null) {
      lightError = error;
    },
    setLostAtFrame(isLost: boolean) {
      isLostAtFrame = isLost;
    },
  };
}

export type FakeSession = ReturnType<typeof fakeSession>;

/** A session that has drawn its first frame; its log is empty. */
export async function loadedSession(settings = SETTINGS): Promise<FakeSession> {
  const fake = fakeSession();
  fake.session.set(settings);
  await fake.finishLoad('a.ltm');
  await fake.createRenderer(0);
  fake.takeLog();
  return fake;
}
