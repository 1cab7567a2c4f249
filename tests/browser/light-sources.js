/** Pictures, films and numbers as light. */

import assert from 'node:assert/strict';
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { describe, test } from 'node:test';
import { compare, decodePng, encodePng } from '../../www/tools/pictures.js';
import {
  details,
  happenedUntil,
  loaded,
  message,
  mount,
  openPage,
  otherOrigin,
  picture,
} from './browser.js';
import { FOLDER, nativePicture } from './photos.js';

/** @typedef {import('playwright-core').Page} Page */

const BACKENDS = ['webgpu', 'webgl2', 'cpu'];
const GLASS = { src: '/photos/glass.ltm', light: 'spectrum' };
const KINDS = ['image', 'canvas', 'offscreen', 'bitmap', 'imageData', 'linear'];

/** Of a size that the light plane does not divide: patches of colour, and grain. */
const PICTURE = {
  width: 150,
  height: 91,
  data: Uint8Array.from({ length: 150 * 91 * 4 }, (_, i) => {
    const [x, y, c] = [(i >> 2) % 150, Math.floor((i >> 2) / 150), i % 4];
    if (c === 3) return 255;
    const patch = (Math.floor(x / 19) * 5 + Math.floor(y / 13) * 3 + c * 2) % 7;
    return patch * 36 + ((i * 7919) % 40);
  }),
};
const FILE = join(FOLDER, 'light.png');
writeFileSync(FILE, encodePng(PICTURE));
const ADDRESS = `data:image/png;base64,${encodePng(PICTURE).toString('base64')}`;

/** For pages to run first: counts what is read of pictures and drawn by workers, and what waits for a frame. */
const counting = () => {
  const counts = { reads: 0, draws: 0 };
  const waiting = new Set();
  Object.assign(globalThis, { counts, waiting });
  const { getImageData, putImageData } = CanvasRenderingContext2D.prototype;
  CanvasRenderingContext2D.prototype.getImageData = /** @type {any} */ (
    /** @this {any} @param {any[]} args */
    function (...args) {
      counts.reads += 1;
      return Reflect.apply(getImageData, this, args);
    }
  );
  CanvasRenderingContext2D.prototype.putImageData = /** @type {any} */ (
    /** @this {any} @param {any[]} args */
    function (...args) {
      counts.draws += 1;
      return Reflect.apply(putImageData, this, args);
    }
  );
  const { requestVideoFrameCallback, cancelVideoFrameCallback } = HTMLVideoElement.prototype;
  HTMLVideoElement.prototype.requestVideoFrameCallback = function (callback) {
    const handle = requestVideoFrameCallback.call(this, (...args) => {
      waiting.delete(handle);
      callback(...args);
    });
    waiting.add(handle);
    return handle;
  };
  HTMLVideoElement.prototype.cancelVideoFrameCallback = function (handle) {
    waiting.delete(handle);
    cancelVideoFrameCallback.call(this, handle);
  };
};

/** Makes all that can be light out of one picture. @param {Page} page */
async function makeSources(page) {
  await page.evaluate(async (address) => {
    const image = new Image();
    image.src = address;
    await image.decode();
    const { width, height } = image;
    const canvas = Object.assign(document.createElement('canvas'), { width, height });
    const offscreen = new OffscreenCanvas(width, height);
    const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
    context.drawImage(image, 0, 0);
    offscreen.getContext('2d')?.drawImage(image, 0, 0);
    const imageData = context.getImageData(0, 0, width, height);
    const decode = (/** @type {number} */ code) =>
      code <= 0.04045 ? code / 12.92 : ((code + 0.055) / 1.055) ** 2.4;
    const data = new Float32Array(width * height * 3);
    for (let i = 0; i < width * height; i += 1) {
      for (let c = 0; c < 3; c += 1) {
        data[3 * i + c] = decode((imageData.data[4 * i + c] ?? 0) / 255);
      }
    }
    const linear = { data, width, height };
    const bitmap = await createImageBitmap(image);
    Object.assign(globalThis, {
      sources: { image, canvas, offscreen, bitmap, imageData, linear },
    });
  }, ADDRESS);
}

/** A canvas of one colour, `paint(colour)`, and a stream of it, `stream`. @param {Page} page */
async function makeStream(page) {
  await page.evaluate(() => {
    const canvas = Object.assign(document.createElement('canvas'), { width: 64, height: 48 });
    const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
    let colour = '#f00';
    const paint = (/** @type {string} */ next) => {
      colour = next;
      context.fillStyle = colour;
      context.fillRect(0, 0, 64, 48);
    };
    paint(colour);
    // A stream has a frame only when its canvas is drawn on.
    setInterval(() => paint(colour), 30);
    Object.assign(globalThis, { canvas, paint, stream: canvas.captureStream(30) });
  });
}

/** A film of a second of red and a second of blue, `video`, as yet without it. @param {Page} page */
async function makeFilm(page) {
  await makeStream(page);
  await page.evaluate(async () => {
    const { paint, stream } = /** @type {any} */ (globalThis);
    const recorder = new MediaRecorder(stream, { mimeType: 'video/webm;codecs=vp8' });
    /** @type {Blob[]} */
    const parts = [];
    recorder.addEventListener('dataavailable', (event) => parts.push(event.data));
    const stopped = new Promise((resolve) => recorder.addEventListener('stop', resolve));
    recorder.start();
    await new Promise((resolve) => setTimeout(resolve, 1000));
    paint('#00f');
    await new Promise((resolve) => setTimeout(resolve, 1000));
    recorder.stop();
    await stopped;
    const video = Object.assign(document.createElement('video'), { muted: true });
    const film = URL.createObjectURL(new Blob(parts, { type: 'video/webm' }));
    Object.assign(globalThis, { video, film });
  });
}

/** Waits until a picture on the screen is red or blue. @param {Page} page @param {'red' | 'blue'} colour */
async function shows(page, colour) {
  await eventually(async () => {
    const { data } = decodePng(await page.locator('relightable-photo').screenshot());
    let [red, blue] = [0, 0];
    for (let at = 0; at < data.length; at += 4) {
      red += data[at] ?? 0;
      blue += data[at + 2] ?? 0;
    }
    return colour === 'red' ? red > 2 * blue : blue > 2 * red;
  }, `a ${colour} picture`);
}

/** Waits for something on the screen. @param {() => Promise<boolean>} condition @param {string} what */
async function eventually(condition, what) {
  for (let i = 0; i < 100; i += 1) {
    if (await condition()) return;
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
  assert.fail(`never came: ${what}`);
}

/** @param {Page} page @param {string} type */
const count = async (page, type) =>
  Number(
    await page.evaluate(
      `happened.filter((event) => event.type === ${JSON.stringify(type)}).length`,
    ),
  );

/** @param {Page} page */
const frames = (page, wait = 300) => page.waitForTimeout(wait);

describe('a light source', () => {
  for (const backend of BACKENDS) {
    test(`of any kind lights on ${backend} as it does the native program, to 1/255`, async (t) => {
      const page = await openPage(t, '/bench');
      await mount(page, { ...GLASS, backend });
      await loaded(page);
      await makeSources(page);
      const want = nativePicture(FILE, 'reference');
      for (const kind of KINDS) {
        await page.evaluate(`photo.lightSource = sources.${kind}`);
        const { worst } = compare(await picture(page), want);
        assert.ok(worst <= 1, `${kind} differs by ${worst}/255`);
        const shown = decodePng(await page.locator('relightable-photo').screenshot());
        assert.ok(compare(shown, want).worst <= 2, `${kind} is not on the screen`);
      }
      await page.evaluate('photo.lightSource = null');
      const back = compare(await picture(page), nativePicture('spectrum', 'reference'));
      assert.ok(back.worst <= 1, 'the built-in light is not back');
      assert.equal(await count(page, 'lightchange'), KINDS.length + 1);
      assert.equal(await count(page, 'error'), 0);
    });

    test(`that is a film is followed on ${backend}`, async (t) => {
      const page = await openPage(t, '/bench');
      await mount(page, { ...GLASS, light: 'flood', backend });
      await loaded(page);
      await makeFilm(page);
      // Nothing to be seen yet: the last light stays.
      await page.evaluate('photo.lightSource = video');
      assert.ok(compare(await picture(page), nativePicture('flood', 'reference')).worst <= 1);
      await page.evaluate('void (video.src = film)');
      await shows(page, 'red');
      await page.evaluate('video.play()');
      await shows(page, 'blue');
      await page.evaluate('video.pause(), void (video.currentTime = 0.1)');
      await shows(page, 'red');
      assert.equal(await count(page, 'lightchange'), 1);
      assert.equal(await count(page, 'error'), 0);
    });
  }

  for (const backend of ['webgpu', 'webgl2']) {
    test(`reaches ${backend} without being read, and stays when the next is refused`, async (t) => {
      const page = await openPage(t, '/bench', { before: counting });
      await mount(page, { ...GLASS, backend });
      await loaded(page);
      await makeSources(page);
      await page.evaluate('counts.reads = 0');
      const want = nativePicture(FILE, 'reference');
      // WebGL2 does not tell whether a bitmap's colours are multiplied by alpha.
      for (const kind of ['canvas', 'offscreen', ...(backend === 'webgpu' ? ['bitmap'] : [])]) {
        await page.evaluate(`photo.lightSource = sources.${kind}`);
        assert.ok(compare(await picture(page), want).worst <= 1, kind);
      }
      const brighter = await picture(page, { exposure: '2' });
      assert.ok(compare(brighter, want).worst > 20);
      assert.equal(await page.evaluate('counts.reads'), 0);
      // One that shows a picture of another origin.
      await page.evaluate(async (address) => {
        const image = new Image();
        image.src = address;
        await image.decode();
        const canvas = Object.assign(document.createElement('canvas'), { width: 9, height: 9 });
        canvas.getContext('2d')?.drawImage(image, 0, 0, 9, 9);
        /** @type {any} */ (globalThis).photo.lightSource = canvas;
      }, `${otherOrigin}/site/icon.svg`);
      const error = (await happenedUntil(page, 'error')).find(({ type }) => type === 'error');
      assert.equal(error?.['code'], 'light-tainted');
      assert.ok(compare(await picture(page, { exposure: '1' }), want).worst <= 1);
    });
  }

  test('that is a film is followed where frames are not told', async (t) => {
    const page = await openPage(t, '/bench', {
      before: () => {
        Reflect.deleteProperty(HTMLVideoElement.prototype, 'requestVideoFrameCallback');
      },
    });
    await mount(page, { ...GLASS, light: 'flood', backend: 'cpu' });
    await loaded(page);
    await makeFilm(page);
    await page.evaluate('photo.lightSource = video, video.src = film, video.play()');
    await shows(page, 'red');
    await shows(page, 'blue');
  });

  test('that is a stream is followed, and read once a picture at most', async (t) => {
    const page = await openPage(t, '/bench', { before: counting });
    await mount(page, { ...GLASS, light: 'flood', backend: 'cpu' });
    await loaded(page);
    await makeStream(page);
    await page.evaluate('photo.lightSource = stream');
    await shows(page, 'red');
    await page.evaluate("paint('#00f')");
    await shows(page, 'blue');
    const before = await page.evaluate('({ ...counts })');
    await frames(page, 1000);
    const after = await page.evaluate('({ ...counts })');
    const [reads, draws] = [after.reads - before.reads, after.draws - before.draws];
    t.diagnostic(`${reads} frames read, ${draws} pictures drawn`);
    assert.ok(reads > 5 && Math.abs(reads - draws) <= 1, `${reads} read, ${draws} drawn`);
    await page.evaluate('photo.lightSource = null');
    assert.equal(await page.evaluate('stream.getVideoTracks()[0].readyState'), 'live');
  });

  for (const [how, leave, back] of [
    ['that is replaced', 'photo.lightSource = null', 'photo.lightSource = source'],
    ['of an element that is removed', 'photo.remove()', 'document.body.append(photo)'],
    [
      'of an element out of view',
      "photo.before(Object.assign(document.createElement('p'), { style: 'height: 5000px' }))",
      'photo.scrollIntoView()',
    ],
    ['of an element that is not displayed', 'photo.hidden = true', 'photo.hidden = false'],
  ]) {
    for (const source of ['video', 'stream']) {
      test(`${how} is left alone: a ${source}`, async (t) => {
        const page = await openPage(t, '/bench', { before: counting });
        await mount(page, { ...GLASS, backend: 'cpu' });
        await loaded(page);
        await (source === 'video' ? makeFilm(page) : makeStream(page));
        if (source === 'video')
          await page.evaluate('(video.loop = true, video.src = film, video.play())');
        await page.evaluate(`void (globalThis.source = ${source}, photo.lightSource = source)`);
        const reads = async () => Number(await page.evaluate('counts.reads'));
        await page.waitForFunction('counts.reads > 3');
        await page.evaluate(`void (${leave})`);
        await page.waitForFunction('waiting.size === 0');
        await frames(page);
        const before = await reads();
        await frames(page);
        assert.equal(await reads(), before);
        assert.equal(await page.evaluate('waiting.size'), 0);
        await page.evaluate(`void (${back})`);
        await page.waitForFunction(`counts.reads > ${before} + 3`);
      });
    }
  }

  test('that changes without telling is looked at when told', async (t) => {
    const page = await openPage(t, '/bench', { before: counting });
    await mount(page, { ...GLASS, backend: 'cpu' });
    await loaded(page);
    await makeStream(page);
    await page.evaluate('photo.lightSource = canvas');
    await shows(page, 'red');
    const reads = await page.evaluate('counts.reads');
    await page.evaluate("paint('#00f')");
    await frames(page);
    assert.equal(await page.evaluate('counts.reads'), reads);
    await page.evaluate('photo.lightChanged(), photo.lightChanged()');
    await shows(page, 'blue');
    assert.equal(await page.evaluate('counts.reads'), reads + 1);
    assert.equal(await count(page, 'lightchange'), 1);
  });

  test('that is an image not there yet lights once it is', async (t) => {
    const page = await openPage(t, '/bench');
    await mount(page, { ...GLASS, backend: 'cpu' });
    await loaded(page);
    await page.evaluate('photo.lightSource = globalThis.image = new Image()');
    assert.ok(compare(await picture(page), nativePicture('spectrum', 'reference')).worst <= 1);
    await page.evaluate((address) => {
      /** @type {any} */ (globalThis).image.src = address;
    }, ADDRESS);
    const want = nativePicture(FILE, 'reference');
    await eventually(async () => {
      const shown = decodePng(await page.locator('relightable-photo').screenshot());
      return compare(shown, want).worst <= 2;
    }, 'the picture in the light of the image');
    assert.equal(await count(page, 'error'), 0);
  });

  test('shines where it is transparent by so much less', async (t) => {
    const page = await openPage(t, '/bench');
    await mount(page, { ...GLASS, backend: 'cpu' });
    await loaded(page);
    await page.evaluate(() => {
      const { photo } = /** @type {any} */ (globalThis);
      const pixel = [255, 255, 255, 51];
      photo.lightSource = new ImageData(Uint8ClampedArray.from([...pixel, ...pixel]), 2, 1);
    });
    const fifth = nativePicture('flood', 'reference', 0.2);
    assert.ok(compare(await picture(page), fifth).worst <= 1);
    await page.evaluate("photo.lightSource = document.createElement('canvas')");
    assert.ok(compare(await picture(page), nativePicture('flood', 'reference', 0)).worst === 0);
  });

  for (const backend of ['webgpu', 'webgl2', 'cpu']) {
    test(`shines by so much less on ${backend}, whatever it is`, async (t) => {
      const page = await openPage(t, '/bench');
      await mount(page, { ...GLASS, backend });
      await loaded(page);
      const fifth = nativePicture('flood', 'reference', 0.2);
      for (const kind of ['canvas', 'bitmap', 'plain']) {
        await page.evaluate(async (kind) => {
          const canvas = Object.assign(document.createElement('canvas'), { width: 9, height: 9 });
          const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
          context.fillStyle = 'rgb(255 255 255 / 0.2)';
          context.fillRect(0, 0, 9, 9);
          const { photo } = /** @type {any} */ (globalThis);
          const apart = /** @type {const} */ ({ premultiplyAlpha: 'none' });
          if (kind === 'canvas') photo.lightSource = canvas;
          else photo.lightSource = await createImageBitmap(canvas, kind === 'plain' ? apart : {});
        }, kind);
        assert.ok(compare(await picture(page), fifth).worst <= 1, kind);
      }
    });
  }

  for (const kind of ['image', 'canvas', 'bitmap']) {
    test(`of another origin is reported, and the last light stays: ${kind}`, async (t) => {
      const page = await openPage(t, '/bench');
      await mount(page, { ...GLASS, backend: 'cpu' });
      await loaded(page);
      await makeSources(page);
      await page.evaluate('photo.lightSource = sources.linear');
      const want = await picture(page);
      await page.evaluate(
        async ({ address, kind }) => {
          const { photo } = /** @type {any} */ (globalThis);
          const image = new Image(40, 40);
          image.src = address;
          await image.decode();
          const canvas = document.createElement('canvas');
          canvas.getContext('2d')?.drawImage(image, 0, 0);
          const bitmap = await createImageBitmap(canvas);
          photo.lightSource = { image, canvas, bitmap }[kind];
        },
        { address: `${otherOrigin}/site/icon.svg`, kind },
      );
      const error = (await happenedUntil(page, 'error')).find(({ type }) => type === 'error');
      assert.equal(error?.['code'], 'light-tainted');
      await (await details(page)).getByText('crossorigin').waitFor();
      assert.equal(compare(await picture(page), want).worst, 0);
      const brighter = await picture(page, { exposure: '2' });
      assert.ok(compare(brighter, want).worst > 20, 'the last light is still a light');
      assert.equal(await count(page, 'error'), 1);
      await page.evaluate('photo.lightSource = sources.canvas');
      await message(page).waitFor({ state: 'hidden' });
      const drawn = await picture(page, { exposure: '1' });
      assert.ok(compare(drawn, nativePicture(FILE, 'reference')).worst <= 1);
    });
  }

  test('that is wrong is reported once, and can be put right', async (t) => {
    const page = await openPage(t, '/bench');
    await mount(page, { ...GLASS, backend: 'cpu' });
    await loaded(page);
    await page.evaluate('photo.lightSource = { data: new Float32Array(5), width: 1, height: 2 }');
    const codes = async () =>
      (await page.evaluate('happened'))
        .filter((/** @type {any} */ { type }) => type === 'error')
        .map((/** @type {any} */ { code }) => code);
    await happenedUntil(page, 'error');
    await (await details(page)).getByText('needs 6').waitFor();
    assert.ok(compare(await picture(page), nativePicture('spectrum', 'reference')).worst <= 1);
    for (const value of ['-1', 'NaN', 'Infinity']) {
      const light = `{ data: new Float32Array([1, 1, ${value}]), width: 1, height: 1 }`;
      await page.evaluate(`globalThis.light = ${light}, photo.lightSource = light`);
      await picture(page);
      await page.evaluate('photo.lightChanged()');
      await frames(page);
    }
    await page.evaluate('light.data.fill(1), photo.lightChanged()');
    await message(page).waitFor({ state: 'hidden' });
    assert.ok(compare(await picture(page), nativePicture('flood', 'reference')).worst <= 1);
    await page.evaluate(() => {
      const { photo } = /** @type {any} */ (globalThis);
      const canvas = document.createElement('canvas');
      canvas.width = 0;
      photo.lightSource = canvas;
    });
    await happenedUntil(page, 'error', 5);
    await page.evaluate("photo.lightSource = Object.assign(new Image(), { src: '/nothing.png' })");
    await happenedUntil(page, 'error', 6);
    await page.evaluate(
      "photo.lightSource = Object.assign(document.createElement('video'), { src: '/nothing.webm' })",
    );
    await happenedUntil(page, 'error', 7);
    const values = Array(3).fill('light-value');
    const sources = Array(2).fill('light-source');
    assert.deepEqual(await codes(), ['light-size', ...values, 'light-size', ...sources]);
    await (await details(page)).getByText('cannot be played').waitFor();
    await page.evaluate('photo.lightSource = null');
    await message(page).waitFor({ state: 'hidden' });
  });

  test('of the wrong type is refused at once', async (t) => {
    const page = await openPage(t, '/bench');
    await mount(page, { ...GLASS, backend: 'cpu' });
    await loaded(page);
    await makeSources(page);
    await page.evaluate('photo.lightSource = sources.bitmap');
    const refusal = await page.evaluate(() => {
      const { photo } = /** @type {any} */ (globalThis);
      try {
        photo.lightSource = 'light.png';
        return '';
      } catch (error) {
        return String(error);
      }
    });
    assert.match(refusal, /^TypeError: lightSource must be null, an image, /);
    assert.ok(await page.evaluate('photo.lightSource === sources.bitmap'));
  });

  test('takes the torch out of the visitor’s hands', async (t) => {
    const page = await openPage(t, '/bench');
    await mount(page, { ...GLASS, light: 'torch', alt: 'A window', backend: 'cpu' });
    await loaded(page);
    await makeSources(page);
    await page.evaluate('photo.lightSource = sources.linear');
    const happened = await happenedUntil(page, 'lightchange');
    assert.deepEqual(happened.at(-1), { type: 'lightchange', light: 'torch', torch: null });
    await page.mouse.move(20, 20);
    await page.keyboard.press('Tab');
    await page.keyboard.press('ArrowLeft');
    assert.equal(await page.evaluate('photo.torch'), null);
    await page.evaluate('photo.lightSource = null');
    await happenedUntil(page, 'lightchange', 2);
    await page.mouse.move(16, 16);
    assert.deepEqual(await page.evaluate('photo.torch'), { x: 0.25, y: 0.25 });
  });

  test('that was set before the element was defined is taken up', async (t) => {
    const page = await openPage(t, '/blank');
    const source = await page.evaluate(async () => {
      const early = document.createElement('relightable-photo');
      const light = { data: new Float32Array(3), width: 1, height: 1 };
      Object.assign(early, { src: '/photos/glass.ltm', backend: 'cpu', lightSource: light });
      early.loading = 'eager';
      document.body.append(early);
      const load = new Promise((resolve) => early.addEventListener('load', resolve));
      const script = '/relightable-photo/relightable-photo.js';
      await import(script);
      await load;
      return early.lightSource === light;
    });
    assert.ok(source);
    assert.ok(compare(await picture(page), nativePicture('flood', 'reference', 0)).worst === 0);
  });
});
