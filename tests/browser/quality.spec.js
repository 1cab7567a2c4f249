/** While the light moves, slow frames lower the quality; at rest the picture has full quality. */

import { compare } from '../../www/tools/pictures.js';
import { expect, note, test } from './fixtures.js';
import {
  capturePicture,
  decodeDataUrl,
  mountPhoto,
  screenPicture,
  waitForEvents,
  waitForFrames,
  waitForLoad,
  waitUntil,
} from './page-helpers.js';
import { nativePicture } from './test-photos.js';

const GLASS = { src: '/photos/glass.ltm', light: 'torch' };
/** Where each movement of the torch ends. */
const REST_POSITION = { x: 0.3, y: 0.65 };
/** Simulated time of a frame in full quality. A frame at a quarter of it is fast enough. */
const SLOW_FRAME_MS = 100;

/**
 * For `before` of `openPage`: `relit` records the quality of each frame of the workers; each frame in full quality
 * takes `slow` milliseconds. After `stopClock()`, `performance.now` advances only by these frames and by `spend`, so
 * that the load of the machine does not matter.
 */
const slowDownWorkers = () => {
  const relit = /** @type {number[]} */ ([]);
  let now = /** @type {number | null} */ (null);
  const stopClock = () => {
    now = performance.now();
    performance.now = () => now ?? 0;
  };
  const spend = (/** @type {number} */ ms) => {
    now = (now ?? 0) + ms;
  };
  Object.assign(globalThis, { relit, slow: 0, stopClock, spend });
  const { Worker } = globalThis;
  globalThis.Worker = class extends Worker {
    /** @override @param {any} message @param {any} transfer */
    postMessage(message, transfer) {
      const task = message?.task?.task;
      if (task?.kind !== 'relight') return super.postMessage(message, transfer);
      const { quality } = task.settings;
      relit.push(quality);
      const ms = /** @type {any} */ (globalThis).slow * quality;
      const send = () => super.postMessage(message, transfer);
      if (now === null) {
        setTimeout(send, ms);
      } else {
        spend(ms);
        send();
      }
    }
  };
};

/**
 * Moves the torch one step a frame until a condition holds, and then to `REST_POSITION`.
 *
 * @param {import('@playwright/test').Page} page
 * @param {string} until an expression
 * @param {string} [busy] an expression for the milliseconds that the page's own script takes in each frame
 */
function moveTorchUntil(page, until, busy = '0') {
  return page.evaluate(`(async () => {
    const deadline = Date.now() + 20000;
    for (let step = 0; !(${until}); step += 1) {
      if (Date.now() > deadline) throw new Error('no frame had ' + ${JSON.stringify(until)});
      photo.torch = { x: (step % 20) / 20, y: 0.5 };
      await new Promise((resolve) => requestAnimationFrame(resolve));
      if (${busy}) spend(${busy});
    }
    photo.torch = ${JSON.stringify(REST_POSITION)};
  })()`);
}

/** Waits until the photograph has loaded, and clears the records of its loading. @param {import('@playwright/test').Page} page */
async function waitAndClear(page) {
  await waitForLoad(page);
  await page.evaluate('void (photoEvents.splice(0), globalThis.relit?.splice(0))');
}

/** The canvas's content. Reading it does not draw a frame. @param {import('@playwright/test').Page} page */
async function canvasPicture(page) {
  const url = String(
    await page.evaluate("photo.shadowRoot.querySelector('canvas').toDataURL('image/png')"),
  );
  return decodeDataUrl(url);
}

/** The qualities that qualitychange events report. @param {import('@playwright/test').Page} page */
const qualityChanges = async (page) =>
  (await waitForEvents(page, 'qualitychange'))
    .filter(({ type }) => type === 'qualitychange')
    .map(({ quality }) => quality);

const pictureAtRest = () => nativePicture('torch', { torch: REST_POSITION });

test.describe('under a moving light, a picture', () => {
  test('has less quality when workers are slow, and full quality at rest', async ({ openPage }) => {
    const page = await openPage('/plain', { before: slowDownWorkers });
    await mountPhoto(page, { ...GLASS, backend: 'cpu' });
    await waitAndClear(page);
    expect(await page.evaluate('photo.quality')).toBe(1);
    await page.evaluate(`slow = ${SLOW_FRAME_MS}`);
    await moveTorchUntil(page, 'photo.quality === 0.25');
    // The frames in progress, and the frame at rest.
    await waitUntil(page, 'photo.quality === 1');
    const atRest = await canvasPicture(page);
    expect(atRest).toMatchPicture(pictureAtRest(), 1);
    expect(await qualityChanges(page)).toStrictEqual([0.25, 1]);
    const relit = () => /** @type {Promise<number[]>} */ (page.evaluate('relit'));
    const before = await relit();
    expect(before.at(-1)).toBe(1);
    expect(before.at(-2)).toBe(0.25);
    await waitForFrames(page, 30);
    expect((await relit()).length, 'one frame at rest is enough').toBe(before.length);
  });

  test('with less quality is similar, and toBlob has full quality', async ({ openPage }) => {
    const page = await openPage('/plain', { before: slowDownWorkers });
    await mountPhoto(page, { ...GLASS, backend: 'cpu' });
    await waitAndClear(page);
    await page.evaluate(`stopClock(), slow = ${SLOW_FRAME_MS}`);
    await moveTorchUntil(page, 'photo.quality === 0.25');
    await page.evaluate(() => {
      const { photo } = /** @type {any} */ (globalThis);
      // Keeps the last frame with less quality.
      const canvas = photo.shadowRoot.querySelector('canvas');
      const { putImageData } = CanvasRenderingContext2D.prototype;
      CanvasRenderingContext2D.prototype.putImageData = /** @type {any} */ (
        /** @this {any} @param {any[]} args */
        function (...args) {
          const { relit } = /** @type {any} */ (globalThis);
          Reflect.apply(putImageData, this, args);
          if (relit.at(-1) < 1) Object.assign(globalThis, { soft: canvas.toDataURL() });
        }
      );
    });
    // Without a movement nothing would be drawn.
    await moveTorchUntil(page, 'step === 1');
    await waitUntil(page, 'photo.quality === 1');
    const url = String(await page.evaluate('soft'));
    const soft = decodeDataUrl(url);
    const { worst, psnr } = compare(soft, pictureAtRest());
    note(`${psnr.toFixed(1)} dB at a quarter of the quality`);
    expect(worst, `${worst} of 255, ${psnr} dB`).toBeGreaterThan(1);
    expect(psnr, `${worst} of 255, ${psnr} dB`).toBeGreaterThan(20);
    await moveTorchUntil(page, 'photo.quality < 1');
    expect(await capturePicture(page)).toMatchPicture(pictureAtRest(), 1);
    expect(await page.evaluate('photo.quality')).toBe(1);
  });

  test('regains its quality when frames become fast', async ({ openPage }) => {
    const page = await openPage('/plain', { before: slowDownWorkers });
    await mountPhoto(page, { ...GLASS, backend: 'cpu' });
    await waitAndClear(page);
    await page.evaluate(`stopClock(), slow = ${SLOW_FRAME_MS}`);
    await moveTorchUntil(page, 'photo.quality === 0.25');
    await page.evaluate('slow = 0');
    await moveTorchUntil(page, 'photo.quality === 0.5');
    await moveTorchUntil(
      page,
      'photo.quality === 1 && relit.slice(-5).every((share) => share === 1)',
    );
  });

  test('has less quality when the browser presents frames late', async ({ openPage }) => {
    const page = await openPage('/plain', { before: slowDownWorkers });
    await mountPhoto(page, { ...GLASS, backend: 'webgl2' });
    await waitAndClear(page);
    await page.evaluate('stopClock()');
    await moveTorchUntil(page, 'photo.quality === 0.25', `${SLOW_FRAME_MS} * photo.quality`);
    await waitUntil(page, 'photo.quality === 1');
    const onScreen = await screenPicture(page);
    expect(onScreen).toMatchPicture(pictureAtRest(), 2);
    expect(await qualityChanges(page)).toStrictEqual([0.25, 1]);
  });

  test('keeps full quality on a page whose own script is slow', async ({ openPage }) => {
    const page = await openPage('/plain', { before: slowDownWorkers });
    await mountPhoto(page, { ...GLASS, backend: 'webgl2' });
    await waitAndClear(page);
    await page.evaluate('stopClock()');
    const tried = "photoEvents.filter(({ type }) => type === 'qualitychange').length === 2";
    await moveTorchUntil(
      page,
      `${tried} && (globalThis.after ??= step + 50) < step`,
      String(SLOW_FRAME_MS),
    );
    expect(await qualityChanges(page)).toStrictEqual([0.25, 1]);
  });
});
