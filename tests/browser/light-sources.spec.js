/** Images, canvases, videos, streams and arrays as the light source. */

import { compare } from '../../www/tools/pictures.js';
import { expect, note, test } from './fixtures.js';
import {
  capturePicture,
  countEvents,
  dominantColour,
  loadPhoto,
  screenPicture,
  waitForEvents,
  waitForFrames,
  waitForWarning,
  waitUntil,
} from './page-helpers.js';
import { LIGHT_IMAGE_FILE, LIGHT_IMAGE_URL, nativePicture } from './test-photos.js';

/** @typedef {import('@playwright/test').Page} Page */

const BACKENDS = ['webgpu', 'webgl2', 'cpu'];
const GLASS = { src: '/photos/glass.ltm', light: 'spectrum' };
const KINDS = ['image', 'canvas', 'offscreen', 'bitmap', 'imageData', 'linear'];

/**
 * For `before` of `openPage`: `counts` has the pictures that are read from canvases and the frames that workers drew,
 * `waiting` the requested video frames.
 */
const countReads = () => {
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

/** Makes one light source of each kind from the same image. @param {Page} page */
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
  }, LIGHT_IMAGE_URL);
}

/**
 * Makes a canvas of one colour, `canvas`, a function that changes the colour, `paint(colour)`, and a stream of the
 * canvas, `stream`.
 *
 * @param {Page} page
 */
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
    // A stream has a new frame only when its canvas is drawn on.
    setInterval(() => paint(colour), 30);
    Object.assign(globalThis, { canvas, paint, stream: canvas.captureStream(30) });
  });
}

/**
 * Makes a video element without a source, `video`. The film at `film` is one second of red and one second of blue.
 *
 * @param {Page} page
 */
async function makeVideo(page) {
  await page.evaluate(() => {
    const video = Object.assign(document.createElement('video'), { muted: true });
    Object.assign(globalThis, { video, film: '/film.webm' });
  });
}

/** Waits until the picture on the screen is red or blue. @param {Page} page @param {'red' | 'blue'} colour */
async function expectColour(page, colour) {
  await expect.poll(async () => dominantColour(await screenPicture(page))).toBe(colour);
}

test.describe('a light source', () => {
  for (const backend of BACKENDS) {
    test(`of each kind agrees with ltm-export on ${backend}`, async ({ openPhoto, step }) => {
      const page = await openPhoto({ ...GLASS, backend });
      await step(`each kind on ${backend} agrees to 1/255`, async () => {
        await makeSources(page);
        const want = nativePicture(LIGHT_IMAGE_FILE);
        for (const kind of KINDS) {
          await page.evaluate(`photo.light = sources.${kind}`);
          const { worst } = compare(await capturePicture(page), want);
          expect(worst, `${kind} differs by ${worst}/255`).toBeLessThanOrEqual(1);
          const shown = await screenPicture(page);
          expect(shown, `${kind} is not on the screen`).toMatchPicture(want, 2);
        }
        await page.evaluate('photo.light = null');
        const back = compare(await capturePicture(page), nativePicture('spectrum'));
        expect(back.worst, 'the built-in light is not back').toBeLessThanOrEqual(1);
        expect(await countEvents(page, 'lightchange')).toBe(KINDS.length + 1);
        expect(await countEvents(page, 'error')).toBe(0);
      });

      await step(`each kind on ${backend} is dimmed by its transparency`, async () => {
        const fifth = nativePicture('flood', { exposure: 0.2 });
        for (const kind of ['canvas', 'bitmap', 'plain']) {
          await page.evaluate(async (kind) => {
            const canvas = Object.assign(document.createElement('canvas'), { width: 9, height: 9 });
            const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
            context.fillStyle = 'rgb(255 255 255 / 0.2)';
            context.fillRect(0, 0, 9, 9);
            const { photo } = /** @type {any} */ (globalThis);
            const apart = /** @type {const} */ ({ premultiplyAlpha: 'none' });
            if (kind === 'canvas') photo.light = canvas;
            else photo.light = await createImageBitmap(canvas, kind === 'plain' ? apart : {});
          }, kind);
          expect(await capturePicture(page), kind).toMatchPicture(fifth, 1);
        }
      });
    });

    test(`that is a video is followed on ${backend}`, async ({ openPhoto }) => {
      const page = await openPhoto({ ...GLASS, light: 'flood', backend });
      await makeVideo(page);
      // The last light stays until the video has a frame.
      await page.evaluate('photo.light = video');
      expect(await capturePicture(page)).toMatchPicture(nativePicture('flood'), 1);
      await page.evaluate('void (video.src = film)');
      await expectColour(page, 'red');
      await page.evaluate('video.play()');
      await expectColour(page, 'blue');
      await page.evaluate('video.pause(), void (video.currentTime = 0.1)');
      await expectColour(page, 'red');
      expect(await countEvents(page, 'lightchange')).toBe(1);
      expect(await countEvents(page, 'error')).toBe(0);
    });
  }

  for (const backend of ['webgpu', 'webgl2']) {
    test(`is uploaded to ${backend} without being read, and stays when the next is refused`, async ({
      openPhoto,
      server,
    }) => {
      const page = await openPhoto({ ...GLASS, backend }, { before: countReads });
      await makeSources(page);
      await page.evaluate('counts.reads = 0');
      const want = nativePicture(LIGHT_IMAGE_FILE);
      // Under WebGL2 nothing tells whether a bitmap's colours are multiplied by alpha, so bitmaps are read.
      for (const kind of ['canvas', 'offscreen', ...(backend === 'webgpu' ? ['bitmap'] : [])]) {
        await page.evaluate(`photo.light = sources.${kind}`);
        expect(await capturePicture(page), kind).toMatchPicture(want, 1);
      }
      const brighter = await capturePicture(page, { exposure: '2' });
      expect(brighter).not.toMatchPicture(want, 20);
      expect(await page.evaluate('counts.reads')).toBe(0);
      // A canvas with an image of another origin.
      await page.evaluate(async (address) => {
        const image = new Image();
        image.src = address;
        await image.decode();
        const canvas = Object.assign(document.createElement('canvas'), { width: 9, height: 9 });
        canvas.getContext('2d')?.drawImage(image, 0, 0, 9, 9);
        /** @type {any} */ (globalThis).photo.light = canvas;
      }, `${server.otherOrigin}/site/icon.svg`);
      expect((await waitForWarning(page))['code']).toBe('light-tainted');
      expect(await capturePicture(page, { exposure: '1' })).toMatchPicture(want, 1);
    });
  }

  test('that is a video is followed without requestVideoFrameCallback', async ({ openPhoto }) => {
    const page = await openPhoto(
      { ...GLASS, light: 'flood', backend: 'cpu' },
      {
        before: () => {
          Reflect.deleteProperty(HTMLVideoElement.prototype, 'requestVideoFrameCallback');
        },
      },
    );
    await makeVideo(page);
    await page.evaluate('photo.light = video, video.src = film, video.play()');
    await expectColour(page, 'red');
    await expectColour(page, 'blue');
  });

  test('that is a stream is followed, and read at most once a frame', async ({ openPhoto }) => {
    const page = await openPhoto(
      { ...GLASS, light: 'flood', backend: 'cpu' },
      { before: countReads },
    );
    await makeStream(page);
    await page.evaluate('photo.light = stream');
    await expectColour(page, 'red');
    await page.evaluate("paint('#00f')");
    await expectColour(page, 'blue');
    const before = await page.evaluate('({ ...counts })');
    await waitForFrames(page, 60);
    const after = await page.evaluate('({ ...counts })');
    const [reads, draws] = [after.reads - before.reads, after.draws - before.draws];
    note(`${reads} frames read, ${draws} pictures drawn`);
    expect(reads, `${reads} read, ${draws} drawn`).toBeGreaterThan(5);
    expect(Math.abs(reads - draws), `${reads} read, ${draws} drawn`).toBeLessThanOrEqual(1);
    await page.evaluate('photo.light = null');
    expect(await page.evaluate('stream.getVideoTracks()[0].readyState')).toBe('live');
  });

  for (const source of ['video', 'stream']) {
    test(`that is a ${source} is not read while it lights nothing`, async ({ openPage, step }) => {
      const page = await openPage('/blank', { before: countReads });
      for (const [how, leave, back] of /** @type {const} */ ([
        ['that is replaced', 'photo.light = null', 'photo.light = source'],
        ['of an element that is removed', 'photo.remove()', 'document.body.append(photo)'],
        [
          'of an element out of view',
          "photo.before(Object.assign(document.createElement('p'), { style: 'height: 5000px' }))",
          'photo.scrollIntoView()',
        ],
        ['of an element that is not displayed', 'photo.hidden = true', 'photo.hidden = false'],
      ])) {
        await step(`a ${source} ${how} is not read`, async () => {
          await loadPhoto(page, { ...GLASS, backend: 'cpu' });
          await (source === 'video' ? makeVideo(page) : makeStream(page));
          if (source === 'video')
            await page.evaluate('(video.loop = true, video.src = film, video.play())');
          await page.evaluate(`void (globalThis.source = ${source}, photo.light = source)`);
          const reads = async () => Number(await page.evaluate('counts.reads'));
          await waitUntil(page, 'counts.reads > 3');
          await page.evaluate(`void (${leave})`);
          await waitUntil(page, 'waiting.size === 0');
          await waitForFrames(page);
          const before = await reads();
          await waitForFrames(page);
          expect(await reads()).toBe(before);
          expect(await page.evaluate('waiting.size')).toBe(0);
          await page.evaluate(`void (${back})`);
          await waitUntil(page, `counts.reads > ${before} + 3`);
        });
      }
    });
  }

  test('that is a canvas is read again after lightChanged', async ({ openPhoto }) => {
    const page = await openPhoto({ ...GLASS, backend: 'cpu' }, { before: countReads });
    await makeStream(page);
    await page.evaluate('photo.light = canvas');
    await expectColour(page, 'red');
    const reads = await page.evaluate('counts.reads');
    await page.evaluate("paint('#00f')");
    await waitForFrames(page);
    expect(await page.evaluate('counts.reads')).toBe(reads);
    await page.evaluate('photo.lightChanged(), photo.lightChanged()');
    await expectColour(page, 'blue');
    expect(await page.evaluate('counts.reads')).toBe(reads + 1);
    expect(await countEvents(page, 'lightchange')).toBe(1);
  });

  test('that is an image takes effect when it has loaded', async ({ openPhoto }) => {
    const page = await openPhoto({ ...GLASS, backend: 'cpu' });
    await page.evaluate('photo.light = globalThis.image = new Image()');
    expect(await capturePicture(page)).toMatchPicture(nativePicture('spectrum'), 1);
    await page.evaluate((address) => {
      /** @type {any} */ (globalThis).image.src = address;
    }, LIGHT_IMAGE_URL);
    const want = nativePicture(LIGHT_IMAGE_FILE);
    await expect(async () => {
      expect(await screenPicture(page)).toMatchPicture(want, 2);
    }).toPass({ timeout: 30_000 });
    expect(await countEvents(page, 'error')).toBe(0);
  });

  test('is dimmed by its transparency', async ({ openPhoto }) => {
    const page = await openPhoto({ ...GLASS, backend: 'cpu' });
    await page.evaluate(() => {
      const { photo } = /** @type {any} */ (globalThis);
      const pixel = [255, 255, 255, 51];
      photo.light = new ImageData(Uint8ClampedArray.from([...pixel, ...pixel]), 2, 1);
    });
    const fifth = nativePicture('flood', { exposure: 0.2 });
    expect(await capturePicture(page)).toMatchPicture(fifth, 1);
    await page.evaluate("photo.light = document.createElement('canvas')");
    expect(await capturePicture(page)).toMatchPicture(nativePicture('flood', { exposure: 0 }), 0);
  });

  test('of another origin causes a warning and the last light stays', async ({
    openPage,
    server,
    step,
  }) => {
    const page = await openPage('/blank');
    for (const kind of ['image', 'canvas', 'bitmap']) {
      await step(`${kind} of another origin`, async () => {
        await loadPhoto(page, { ...GLASS, backend: 'cpu' });
        await makeSources(page);
        await page.evaluate('photo.light = sources.linear');
        const want = await capturePicture(page);
        await page.evaluate(
          async ({ address, kind }) => {
            const { photo } = /** @type {any} */ (globalThis);
            const image = new Image(40, 40);
            image.src = address;
            await image.decode();
            const canvas = document.createElement('canvas');
            canvas.getContext('2d')?.drawImage(image, 0, 0);
            const bitmap = await createImageBitmap(canvas);
            photo.light = { image, canvas, bitmap }[kind];
          },
          { address: `${server.otherOrigin}/site/icon.svg`, kind },
        );
        const warning = await waitForWarning(page);
        expect(warning['code']).toBe('light-tainted');
        expect(warning['message']).toContain('crossorigin');
        expect(await capturePicture(page)).toMatchPicture(want, 0);
        const brighter = await capturePicture(page, { exposure: '2' });
        expect(brighter, 'the last light stays in use').not.toMatchPicture(want, 20);
        expect(await countEvents(page, 'warning')).toBe(1);
        await page.evaluate('photo.light = sources.canvas');
        const drawn = await capturePicture(page, { exposure: '1' });
        expect(drawn).toMatchPicture(nativePicture(LIGHT_IMAGE_FILE), 1);
      });
    }
  });

  test('that is invalid is reported once, and can be corrected', async ({ openPhoto }) => {
    const page = await openPhoto({ ...GLASS, backend: 'cpu' });
    await page.evaluate('photo.light = { data: new Float32Array(5), width: 1, height: 2 }');
    const codes = async () =>
      (await page.evaluate('photoEvents'))
        .filter((/** @type {any} */ { type }) => type === 'warning')
        .map((/** @type {any} */ { code }) => code);
    expect((await waitForWarning(page))['message']).toContain('need 6');
    expect(await capturePicture(page)).toMatchPicture(nativePicture('spectrum'), 1);
    for (const value of ['-1', 'NaN', 'Infinity']) {
      const light = `{ data: new Float32Array([1, 1, ${value}]), width: 1, height: 1 }`;
      await page.evaluate(`globalThis.light = ${light}, photo.light = light`);
      await capturePicture(page);
      await page.evaluate('photo.lightChanged()');
      await waitForFrames(page);
    }
    await page.evaluate('light.data.fill(1), photo.lightChanged()');
    expect(await capturePicture(page)).toMatchPicture(nativePicture('flood'), 1);
    await page.evaluate(() => {
      const { photo } = /** @type {any} */ (globalThis);
      const canvas = document.createElement('canvas');
      canvas.width = 0;
      photo.light = canvas;
    });
    await waitForWarning(page, 5);
    await page.evaluate("photo.light = Object.assign(new Image(), { src: '/nothing.png' })");
    await waitForWarning(page, 6);
    await page.evaluate(
      "photo.light = Object.assign(document.createElement('video'), { src: '/nothing.webm' })",
    );
    expect((await waitForWarning(page, 7))['message']).toContain('cannot be played');
    const values = Array(3).fill('light-value');
    const sources = Array(2).fill('light-source');
    expect(await codes()).toStrictEqual(['light-size', ...values, 'light-size', ...sources]);
  });

  test('of the wrong type throws', async ({ openPhoto }) => {
    const page = await openPhoto({ ...GLASS, backend: 'cpu' });
    await makeSources(page);
    await page.evaluate('photo.light = sources.bitmap');
    const refusal = await page.evaluate(() => {
      const { photo } = /** @type {any} */ (globalThis);
      try {
        photo.light = 7;
        return '';
      } catch (error) {
        return String(error);
      }
    });
    expect(refusal).toMatch(/^TypeError: light must be null, the name of a built-in light, /);
    expect(await page.evaluate('photo.light === sources.bitmap')).toBeTruthy();
  });

  test('disables the torch', async ({ openPhoto }) => {
    const page = await openPhoto({ ...GLASS, light: 'torch', alt: 'A window', backend: 'cpu' });
    await makeSources(page);
    await page.evaluate('photo.light = sources.linear');
    const photoEvents = await waitForEvents(page, 'lightchange');
    expect(photoEvents.at(-1)).toStrictEqual({ type: 'lightchange', light: 'torch', torch: null });
    await page.mouse.move(20, 20);
    await page.keyboard.press('Tab');
    await page.keyboard.press('ArrowLeft');
    expect(await page.evaluate('photo.torch')).toBeNull();
    await page.evaluate('photo.light = null');
    await waitForEvents(page, 'lightchange', 2);
    await page.mouse.move(16, 16);
    expect(await page.evaluate('photo.torch')).toStrictEqual({ x: 0.25, y: 0.25 });
  });

  test('that was set before the element was defined takes effect', async ({ openPage }) => {
    const page = await openPage('/blank');
    const source = await page.evaluate(async () => {
      const early = document.createElement('relightable-photo');
      const light = { data: new Float32Array(3), width: 1, height: 1 };
      Object.assign(early, { src: '/photos/glass.ltm', backend: 'cpu', light });
      early.loading = 'eager';
      document.body.append(early);
      const load = new Promise((resolve) => early.addEventListener('load', resolve));
      const script = '/relightable-photo/relightable-photo.js';
      await import(script);
      await load;
      return early.light === light;
    });
    expect(source).toBeTruthy();
    expect(await capturePicture(page)).toMatchPicture(nativePicture('flood', { exposure: 0 }), 0);
  });
});
