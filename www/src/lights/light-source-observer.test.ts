import assert from 'node:assert/strict';
import { type TestContext, test } from 'node:test';
import { checkLightSource, type LightSource } from './light-source.js';
import { LightSourceObserver } from './light-source-observer.js';

/** An `EventTarget` that counts its listeners. */
class CountingTarget extends EventTarget {
  listeners = 0;

  override addEventListener(
    type: string,
    listener: () => void,
    { signal }: { signal?: AbortSignal } = {},
  ): void {
    super.addEventListener(type, listener, signal ? { signal } : {});
    this.listeners += 1;
    signal?.addEventListener('abort', () => {
      this.listeners -= 1;
    });
  }

  fire(type: string): void {
    this.dispatchEvent(new Event(type));
  }
}

class FakeImage extends CountingTarget {
  complete = false;
  currentSrc = 'a.png';
  naturalWidth = 0;
  decode = async () => {};
}

class FakeVideo extends CountingTarget {
  paused = false;
  ended = false;
  readyState = 0;
  currentTime = 0;
  currentSrc = 'a.webm';
  error: { message: string } | null = null;
  srcObject: unknown = null;
  played: () => Promise<void> = async () => {};
  play = () => this.played();
  pause = () => {};
}

/** A video that reports its frames. */
class FrameCallbackVideo extends FakeVideo {
  readonly waiting = new Map<number, () => void>();
  #last = 0;

  requestVideoFrameCallback(callback: () => void): number {
    this.#last += 1;
    this.waiting.set(this.#last, callback);
    return this.#last;
  }

  cancelVideoFrameCallback(handle: number): void {
    this.waiting.delete(handle);
  }

  frame(): void {
    const callbacks = [...this.waiting.values()];
    this.waiting.clear();
    for (const callback of callbacks) callback();
  }
}

class FakeStream {}

const settle = () => new Promise((resolve) => setImmediate(resolve));

/** Installs fakes of the browser's classes. `streamed` is the video that plays a stream. */
function fakeBrowser(t: TestContext) {
  const animation = new Map<number, () => void>();
  let last = 0;
  const streamed = new FrameCallbackVideo();
  const fakes = {
    HTMLImageElement: FakeImage,
    HTMLVideoElement: FakeVideo,
    MediaStream: FakeStream,
    document: { createElement: () => streamed },
    requestAnimationFrame: (callback: () => void) => {
      last += 1;
      animation.set(last, callback);
      return last;
    },
    cancelAnimationFrame: (handle: number) => animation.delete(handle),
  };
  Object.assign(globalThis, fakes);
  t.after(() => {
    for (const name of Object.keys(fakes)) Reflect.deleteProperty(globalThis, name);
  });
  const frame = () => {
    const callbacks = [...animation.values()];
    animation.clear();
    for (const callback of callbacks) callback();
  };
  return { animation, frame, streamed };
}

function observe(source: unknown) {
  const log: string[] = [];
  const observer = new LightSourceObserver(source as LightSource, {
    changed: () => log.push('changed'),
    errorChanged: (error) => log.push(error ? error.code : 'no error'),
  });
  return { observer, calls: () => log.splice(0) };
}

test('frames of a video are reported until the observer stops', (t) => {
  fakeBrowser(t);
  const video = new FrameCallbackVideo();
  const { observer, calls } = observe(video);
  assert.equal(video.waiting.size, 0);
  observer.start();
  observer.start();
  video.fire('loadeddata');
  video.frame();
  video.frame();
  video.fire('seeked');
  assert.equal(calls().length, 4);
  observer.stop();
  assert.equal(video.waiting.size + video.listeners, 0);
});

test('a video without frame callbacks is polled while it plays', (t) => {
  const { animation, frame } = fakeBrowser(t);
  const video = new FakeVideo();
  video.paused = true;
  const { observer, calls } = observe(video);
  observer.start();
  assert.equal(animation.size, 0);
  video.paused = false;
  video.fire('playing');
  video.fire('playing');
  frame();
  frame();
  assert.equal(calls().length, 2);
  video.paused = true;
  frame();
  assert.equal(animation.size + calls().length, 0);
  video.paused = false;
  video.fire('playing');
  observer.stop();
  assert.equal(animation.size + video.listeners, 0);
});

test('a change while stopped is reported at the next start', (t) => {
  fakeBrowser(t);
  const video = new FrameCallbackVideo();
  const { observer, calls } = observe(video);
  observer.start();
  observer.stop();
  observer.start();
  assert.deepEqual(calls(), []);
  observer.stop();
  video.currentTime = 1;
  observer.start();
  assert.deepEqual(calls(), ['changed']);
});

test('loading an image is reported, and so is a failure', async (t) => {
  fakeBrowser(t);
  const image = new FakeImage();
  const { observer, calls } = observe(image);
  observer.start();
  assert.deepEqual(calls(), []);
  image.fire('error');
  assert.match(observer.error?.message ?? '', /a\.png/);
  image.fire('error');
  assert.deepEqual(calls(), ['light-source']);
  image.fire('load');
  await settle();
  assert.deepEqual(calls(), ['no error', 'changed']);
  assert.equal(observer.error, null);
  image.fire('load');
  observer.stop();
  await settle();
  assert.deepEqual(calls(), []);
  assert.equal(image.listeners, 0);
});

test('an earlier failure of an image is reported at the start', (t) => {
  fakeBrowser(t);
  const { observer, calls } = observe(Object.assign(new FakeImage(), { complete: true }));
  observer.start();
  assert.deepEqual(calls(), ['light-source']);
});

test('a stream plays while it is observed', async (t) => {
  const { streamed } = fakeBrowser(t);
  const stream = new FakeStream();
  const { observer, calls } = observe(stream);
  assert.equal(observer.picture, streamed as unknown);
  observer.start();
  assert.equal(streamed.srcObject, stream);
  streamed.frame();
  assert.deepEqual(calls(), ['changed']);
  streamed.fire('ended');
  assert.deepEqual(calls(), ['light-source'], 'a camera may be disconnected');
  streamed.frame();
  assert.deepEqual(calls(), ['no error', 'changed']);
  observer.stop();
  assert.equal(streamed.srcObject, null);
  streamed.played = () => Promise.reject(new Error('not allowed'));
  observer.start();
  await settle();
  assert.deepEqual(calls(), ['light-source']);
  observer.stop();
  observer.start();
  observer.stop();
  await settle();
  assert.deepEqual(calls(), [], 'the failure belongs to an earlier start');
});

test('other values are rejected with the accepted classes', (t) => {
  fakeBrowser(t);
  const linear = { data: new Float32Array(3), width: 1, height: 1 };
  for (const source of [new FakeImage(), new FakeStream(), linear]) {
    assert.equal(checkLightSource(source), source);
  }
  for (const wrong of [undefined, 'a.png', 7, {}, { data: [1, 1, 1], width: 1, height: 1 }]) {
    assert.throws(() => checkLightSource(wrong), /^TypeError: light must be .*MediaStream/);
  }
});
