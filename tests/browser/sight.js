/** Only what is seen is drawn. */

import assert from 'node:assert/strict';
import { describe, test } from 'node:test';
import { compare, decodePng } from '../../www/tools/pictures.js';
import { loaded, mount, openPage, picture } from './browser.js';
import { nativePicture } from './photos.js';

const GLASS = { src: '/photos/glass.ltm', light: 'torch', backend: 'cpu' };

/** For pages to run first: counts pictures that workers drew. The fixture has one share of them. */
const counting = () => {
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

/** @param {import('playwright-core').Page} page */
const draws = async (page) => Number(await page.evaluate('counts.draws'));

/** Moves the torch, one step a frame. @param {import('playwright-core').Page} page */
const moveTorch = (page) =>
  page.evaluate(async () => {
    const { photo } = /** @type {any} */ (globalThis);
    for (let i = 1; i <= 10; i += 1) {
      photo.torch = { x: i / 20, y: 0.65 };
      await new Promise((resolve) => requestAnimationFrame(resolve));
    }
    photo.torch = { x: 0.3, y: 0.65 };
    await new Promise((resolve) => setTimeout(resolve, 100));
  });

/** @param {import('node:test').TestContext} t */
async function farBelow(t) {
  const page = await openPage(t, '/bench', { before: counting });
  await page.evaluate('document.body.innerHTML = \'<p style="height: 5000px"></p>\'');
  await mount(page, { ...GLASS, loading: 'eager' });
  await loaded(page);
  // Until the browser has told what is in view.
  await page.waitForTimeout(200);
  return page;
}

describe('an element out of view', () => {
  test('is drawn when it has loaded, and then once it comes into view', async (t) => {
    const page = await farBelow(t);
    // Of the beginning of the file too, where there was time.
    const first = await draws(page);
    assert.ok(first >= 1);
    await moveTorch(page);
    assert.equal(await draws(page), first);
    await page.evaluate('photo.scrollIntoView()');
    await page.waitForFunction(`counts.draws === ${first + 1}`);
    const shown = decodePng(await page.locator('relightable-photo').screenshot());
    const want = nativePicture('torch', 'reference', 1, { x: 0.3, y: 0.65 });
    assert.ok(compare(shown, want).worst <= 2);
    assert.equal(await draws(page), first + 1);
    // Nothing has changed meanwhile.
    await page.evaluate('scrollTo(0, 0)');
    await page.waitForTimeout(200);
    await page.evaluate('photo.scrollIntoView()');
    await page.waitForTimeout(200);
    assert.equal(await draws(page), first + 1);
    await moveTorch(page);
    assert.ok((await draws(page)) > first + 4);
  });

  test('gives its picture to whoever asks', async (t) => {
    const page = await farBelow(t);
    const first = await draws(page);
    await moveTorch(page);
    const want = nativePicture('torch', 'reference', 1, { x: 0.3, y: 0.65 });
    assert.ok(compare(await picture(page), want).worst <= 1);
    assert.equal(await draws(page), first + 1);
    await page.evaluate('photo.scrollIntoView()');
    await page.waitForTimeout(200);
    assert.equal(await draws(page), first + 1, 'it was up to date');
  });

  test('nor displayed is drawn once it is', async (t) => {
    const page = await openPage(t, '/bench', { before: counting });
    await mount(page, GLASS);
    await loaded(page);
    await page.evaluate('photo.hidden = true');
    await page.waitForTimeout(200);
    const before = await draws(page);
    await moveTorch(page);
    assert.equal(await draws(page), before);
    await page.evaluate('photo.hidden = false');
    await page.waitForFunction(`counts.draws === ${before + 1}`);
  });
});
