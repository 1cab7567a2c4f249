/** A moving picture is drawn by as much of the photograph as there is time for, and in full at rest. */

import assert from 'node:assert/strict';
import { describe, test } from 'node:test';
import { compare, decodePng } from '../../www/tools/pictures.js';
import { happenedUntil, loaded, mount, openPage, picture } from './browser.js';
import { nativePicture } from './photos.js';

const GLASS = { src: '/photos/glass.ltm', light: 'torch' };
/** Where the torch comes to rest. */
const REST = { x: 0.3, y: 0.65 };
/** Of a frame in full detail, where a test makes it so slow. A quarter of it is well in time. */
const SLOW_MS = 100;

/**
 * For pages to run first: `relit` has the shares of all frames of workers, each of which takes `slow`
 * milliseconds in full detail. After `fakeClock()` time goes by only in these, and by `spend`: machines that
 * run tests have other things to do.
 */
const slowed = () => {
  const relit = /** @type {number[]} */ ([]);
  let now = /** @type {number | null} */ (null);
  const fakeClock = () => {
    now = performance.now();
    performance.now = () => now ?? 0;
  };
  const spend = (/** @type {number} */ ms) => {
    now = (now ?? 0) + ms;
  };
  Object.assign(globalThis, { relit, slow: 0, fakeClock, spend });
  const { Worker } = globalThis;
  globalThis.Worker = class extends Worker {
    /** @override @param {any} message @param {any} transfer */
    postMessage(message, transfer) {
      if (message.task?.kind !== 'relight') return super.postMessage(message, transfer);
      const { detail } = message.task.showing;
      relit.push(detail);
      const ms = /** @type {any} */ (globalThis).slow * detail;
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
 * Moves the torch, a step a frame, until this holds, and then to its rest. Each frame of the page spends
 * what `busy` says.
 *
 * @param {import('playwright-core').Page} page
 * @param {string} until
 * @param {string} [busy] milliseconds
 */
function move(page, until, busy = '0') {
  return page.evaluate(`(async () => {
    const deadline = Date.now() + 20000;
    for (let step = 0; !(${until}); step += 1) {
      if (Date.now() > deadline) throw new Error('it never came to ' + ${JSON.stringify(until)});
      photo.torch = { x: (step % 20) / 20, y: 0.5 };
      await new Promise((resolve) => requestAnimationFrame(resolve));
      if (${busy}) spend(${busy});
    }
    photo.torch = ${JSON.stringify(REST)};
  })()`);
}

/** Waits for a photograph, and forgets what was drawn of it while it came. @param {import('playwright-core').Page} page */
async function ready(page) {
  await loaded(page);
  await page.evaluate('void (happened.splice(0), globalThis.relit?.splice(0))');
}

/** What is on the canvas, without asking for it to be drawn. @param {import('playwright-core').Page} page */
async function shown(page) {
  const url = String(
    await page.evaluate("photo.shadowRoot.querySelector('canvas').toDataURL('image/png')"),
  );
  return decodePng(Buffer.from(url.slice(url.indexOf(',') + 1), 'base64'));
}

/** @param {import('playwright-core').Page} page */
const shares = async (page) =>
  (await happenedUntil(page, 'qualitychange'))
    .filter(({ type }) => type === 'qualitychange')
    .map(({ share }) => share);

const want = () => nativePicture('torch', 'reference', 1, REST);

describe('a picture that moves', () => {
  test('is drawn by less where workers are slow, and in full once it rests', async (t) => {
    const page = await openPage(t, '/bench', { before: slowed });
    await mount(page, { ...GLASS, backend: 'cpu' });
    await ready(page);
    assert.equal(await page.evaluate('photo.detail'), 1);
    await page.evaluate(`slow = ${SLOW_MS}`);
    await move(page, 'photo.detail === 0.25');
    // Frames under way, and the rest of them.
    await page.waitForFunction('photo.detail === 1');
    const atRest = await shown(page);
    assert.ok(compare(atRest, want()).worst <= 1);
    assert.deepEqual(await shares(page), [0.25, 1]);
    const relit = () => /** @type {Promise<number[]>} */ (page.evaluate('relit'));
    const before = await relit();
    assert.equal(before.at(-1), 1);
    assert.equal(before.at(-2), 0.25);
    await page.waitForTimeout(500);
    assert.equal((await relit()).length, before.length, 'one frame is enough');
  });

  test('is softer, but the same, and given in full to whoever asks', async (t) => {
    const page = await openPage(t, '/bench', { before: slowed });
    await mount(page, { ...GLASS, backend: 'cpu' });
    await ready(page);
    await page.evaluate(`fakeClock(), slow = ${SLOW_MS}`);
    await move(page, 'photo.detail === 0.25');
    await page.evaluate(() => {
      const { photo } = /** @type {any} */ (globalThis);
      // Of the frames by less, the last stays.
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
    // Where it is already, nothing would be drawn.
    await move(page, 'step === 1');
    await page.waitForFunction('photo.detail === 1');
    const url = String(await page.evaluate('soft'));
    const soft = decodePng(Buffer.from(url.slice(url.indexOf(',') + 1), 'base64'));
    const { worst, psnr } = compare(soft, want());
    t.diagnostic(`${psnr.toFixed(1)} dB by a quarter`);
    assert.ok(worst > 1 && psnr > 20, `${worst} of 255, ${psnr} dB`);
    await move(page, 'photo.detail < 1');
    assert.ok(compare(await picture(page), want()).worst <= 1);
    assert.equal(await page.evaluate('photo.detail'), 1);
  });

  test('has its detail back while it moves, once there is time', async (t) => {
    const page = await openPage(t, '/bench', { before: slowed });
    await mount(page, { ...GLASS, backend: 'cpu' });
    await ready(page);
    await page.evaluate(`fakeClock(), slow = ${SLOW_MS}`);
    await move(page, 'photo.detail === 0.25');
    await page.evaluate('slow = 0');
    await move(page, 'photo.detail === 0.5');
    await move(page, 'photo.detail === 1 && relit.slice(-5).every((share) => share === 1)');
  });

  test('is drawn by less where the browser’s own frames are late', async (t) => {
    const page = await openPage(t, '/bench', { before: slowed });
    await mount(page, { ...GLASS, backend: 'webgl2' });
    await ready(page);
    await page.evaluate('fakeClock()');
    await move(page, 'photo.detail === 0.25', `${SLOW_MS} * photo.detail`);
    await page.waitForFunction('photo.detail === 1');
    const onScreen = decodePng(await page.locator('relightable-photo').screenshot());
    assert.ok(compare(onScreen, want()).worst <= 2);
    assert.deepEqual(await shares(page), [0.25, 1]);
  });

  test('is left in full detail on a page that is slow by itself', async (t) => {
    const page = await openPage(t, '/bench', { before: slowed });
    await mount(page, { ...GLASS, backend: 'webgl2' });
    await ready(page);
    await page.evaluate('fakeClock()');
    const tried = "happened.filter(({ type }) => type === 'qualitychange').length === 2";
    await move(page, `${tried} && (globalThis.after ??= step + 50) < step`, String(SLOW_MS));
    assert.deepEqual(await shares(page), [0.25, 1]);
  });
});
