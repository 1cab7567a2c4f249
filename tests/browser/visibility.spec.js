/** Elements outside the viewport, and hidden ones, are not drawn. */

import { expect, test } from './fixtures.js';
import {
  capturePicture,
  mountPhoto,
  screenPicture,
  waitForFrames,
  waitForLoad,
  waitUntil,
} from './page-helpers.js';
import { nativePicture } from './test-photos.js';

const GLASS = { src: '/photos/glass.ltm', light: 'torch', backend: 'cpu' };

/** For `before` of `openPage`: counts the frames that workers drew. Each is one row range, as the photograph is small. */
const countDraws = () => {
  const counts = { draws: 0 };
  Object.assign(globalThis, { counts });
  const { putImageData } = CanvasRenderingContext2D.prototype;
  CanvasRenderingContext2D.prototype.putImageData = /** @type {any} */ (
    /** @this {any} @param {any[]} args */
    function (...args) {
      counts.draws += 1;
      return Reflect.apply(putImageData, this, args);
    }
  );
};

/** @param {import('@playwright/test').Page} page */
const drawCount = async (page) => Number(await page.evaluate('counts.draws'));

/** Moves the torch in ten frames, and waits for a few more. @param {import('@playwright/test').Page} page */
const moveTorch = (page) =>
  page.evaluate(async () => {
    const { photo } = /** @type {any} */ (globalThis);
    for (let i = 1; i <= 10; i += 1) {
      photo.torch = { x: i / 20, y: 0.65 };
      await new Promise((resolve) => requestAnimationFrame(resolve));
    }
    photo.torch = { x: 0.3, y: 0.65 };
    for (let i = 0; i < 6; i += 1) await new Promise(requestAnimationFrame);
  });

/**
 * Loads an element far below the viewport.
 *
 * @param {import('./fixtures.js').OpenPage} openPage
 */
async function mountBelowViewport(openPage) {
  const page = await openPage('/plain', { before: countDraws });
  await page.evaluate('document.body.innerHTML = \'<p style="height: 5000px"></p>\'');
  await mountPhoto(page, { ...GLASS, loading: 'eager' });
  await waitForLoad(page);
  // The browser reports the visibility within a few frames.
  await waitForFrames(page, 5);
  return page;
}

test.describe('an element outside the viewport', () => {
  test('is drawn once loaded, and again when it enters the viewport', async ({ openPage }) => {
    const page = await mountBelowViewport(openPage);
    // A preview may have been drawn before.
    const first = await drawCount(page);
    expect(first).toBeGreaterThanOrEqual(1);
    await moveTorch(page);
    expect(await drawCount(page)).toBe(first);
    await page.evaluate('photo.scrollIntoView()');
    await waitUntil(page, `counts.draws === ${first + 1}`);
    const shown = await screenPicture(page);
    const want = nativePicture('torch', { torch: { x: 0.3, y: 0.65 } });
    expect(shown).toMatchPicture(want, 2);
    expect(await drawCount(page)).toBe(first + 1);
    // The picture is up to date.
    await page.evaluate('scrollTo(0, 0)');
    await waitForFrames(page);
    await page.evaluate('photo.scrollIntoView()');
    await waitForFrames(page);
    expect(await drawCount(page)).toBe(first + 1);
    await moveTorch(page);
    expect(await drawCount(page)).toBeGreaterThan(first + 4);
  });

  test('is drawn for toBlob', async ({ openPage }) => {
    const page = await mountBelowViewport(openPage);
    const first = await drawCount(page);
    await moveTorch(page);
    const want = nativePicture('torch', { torch: { x: 0.3, y: 0.65 } });
    expect(await capturePicture(page)).toMatchPicture(want, 1);
    expect(await drawCount(page)).toBe(first + 1);
    await page.evaluate('photo.scrollIntoView()');
    await waitForFrames(page);
    expect(await drawCount(page), 'the picture was up to date').toBe(first + 1);
  });

  test('or hidden is drawn when it is shown', async ({ openPhoto }) => {
    const page = await openPhoto(GLASS, { before: countDraws });
    await page.evaluate('photo.hidden = true');
    await waitForFrames(page, 5);
    const before = await drawCount(page);
    await moveTorch(page);
    expect(await drawCount(page)).toBe(before);
    await page.evaluate('photo.hidden = false');
    await waitUntil(page, `counts.draws === ${before + 1}`);
  });
});
