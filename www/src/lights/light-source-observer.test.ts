import assert from 'node:assert/strict';
import { type TestContext, test } from 'node:test';
import { checkLightSource, type LightSource } from './light-source.js';
import { LightSourceObserver } from './light-source-observer.js';

/** Counts listeners, as an `EventTarget` does not. */
class Target extends EventTarget {
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

  happens(type: string): void {
    this.dispatchEvent(new Event(type));
  }
}

class FakeImage extends Target {
  complete = false;
  currentSrc = 'a.png';
  naturalWidth = 0;
  decode = async () => {};
}

class FakeVideo extends Target {
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

/** One that tells of its frames. */
class TellingVideo extends FakeVideo {
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

/** What of the browser is used; the video of a stream is `streamed`. */
function browser(t: TestContext) {
  const animation = new Map<number, () => void>();
  let last = 0;
  const streamed = new TellingVideo();
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

function follow(source: unknown) {
  const log: string[] = [];
  const follower = new LightSourceObserver(source as LightSource, {
    changed: () => log.push('changed'),
    errorChanged: (fault) => log.push(fault ? fault.code : 'well'),
  });
  return { follower, happened: () => log.splice(0) };
}

test('frames of a video are told, and none once it is stopped', (t) => {
  browser(t);
  const video = new TellingVideo();
  const { follower, happened } = follow(video);
  assert.equal(video.waiting.size, 0);
  follower.start();
  follower.start();
  video.happens('loadeddata');
  video.frame();
  video.frame();
  video.happens('seeked');
  assert.equal(happened().length, 4);
  follower.stop();
  assert.equal(video.waiting.size + video.listeners, 0);
});

test('a video that does not tell of its frames is looked at while it plays', (t) => {
  const { animation, frame } = browser(t);
  const video = new FakeVideo();
  video.paused = true;
  const { follower, happened } = follow(video);
  follower.start();
  assert.equal(animation.size, 0);
  video.paused = false;
  video.happens('playing');
  video.happens('playing');
  frame();
  frame();
  assert.equal(happened().length, 2);
  video.paused = true;
  frame();
  assert.equal(animation.size + happened().length, 0);
  video.paused = false;
  video.happens('playing');
  follower.stop();
  assert.equal(animation.size + video.listeners, 0);
});

test('what became of a source while nobody looked is told once somebody does', (t) => {
  browser(t);
  const video = new TellingVideo();
  const { follower, happened } = follow(video);
  follower.start();
  follower.stop();
  follower.start();
  assert.deepEqual(happened(), []);
  follower.stop();
  video.currentTime = 1;
  follower.start();
  assert.deepEqual(happened(), ['changed']);
});

test('an image is told of when it has loaded, or cannot', async (t) => {
  browser(t);
  const image = new FakeImage();
  const { follower, happened } = follow(image);
  follower.start();
  assert.deepEqual(happened(), []);
  image.happens('error');
  assert.match(follower.error?.message ?? '', /a\.png/);
  image.happens('error');
  assert.deepEqual(happened(), ['light-source']);
  image.happens('load');
  await settle();
  assert.deepEqual(happened(), ['well', 'changed']);
  assert.equal(follower.error, null);
  image.happens('load');
  follower.stop();
  await settle();
  assert.deepEqual(happened(), []);
  assert.equal(image.listeners, 0);
});

test('an image that could not be loaded before says so', (t) => {
  browser(t);
  const { follower, happened } = follow(Object.assign(new FakeImage(), { complete: true }));
  follower.start();
  assert.deepEqual(happened(), ['light-source']);
});

test('a stream is played while somebody looks, and its tracks are left alone', async (t) => {
  const { streamed } = browser(t);
  const stream = new FakeStream();
  const { follower, happened } = follow(stream);
  assert.equal(follower.picture, streamed as unknown);
  follower.start();
  assert.equal(streamed.srcObject, stream);
  streamed.frame();
  assert.deepEqual(happened(), ['changed']);
  streamed.happens('ended');
  assert.deepEqual(happened(), ['light-source'], 'a camera may be unplugged');
  streamed.frame();
  assert.deepEqual(happened(), ['well', 'changed']);
  follower.stop();
  assert.equal(streamed.srcObject, null);
  streamed.played = () => Promise.reject(new Error('not allowed'));
  follower.start();
  await settle();
  assert.deepEqual(happened(), ['light-source']);
  follower.stop();
  follower.start();
  follower.stop();
  await settle();
  assert.deepEqual(happened(), [], 'it was stopped on purpose');
});

test('what cannot be light is refused by name', (t) => {
  browser(t);
  const linear = { data: new Float32Array(3), width: 1, height: 1 };
  for (const source of [new FakeImage(), new FakeStream(), linear]) {
    assert.equal(checkLightSource(source), source);
  }
  for (const wrong of [undefined, 'a.png', 7, {}, { data: [1, 1, 1], width: 1, height: 1 }]) {
    assert.throws(() => checkLightSource(wrong), /^TypeError: lightSource must be .*MediaStream/);
  }
});
