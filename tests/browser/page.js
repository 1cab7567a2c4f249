/** The gallery's first picture, as visitors meet it. */

import assert from 'node:assert/strict';
import { join } from 'node:path';
import { describe, test } from 'node:test';
import { brightest, decodePng, encodePng } from '../../www/tools/pictures.js';
import { openPage } from './browser.js';
import { SCREENSHOTS } from './photos.js';

/** @param {import('playwright-core').Page} page */
async function drawn(page) {
  await page.waitForFunction(() => document.querySelector('relightable-photo')?.activeBackend);
  await page.locator('#photo canvas').waitFor();
  // Of all of the photograph.
  await page.locator('#photo').getByRole('progressbar').waitFor({ state: 'hidden' });
}

/** @param {import('playwright-core').Page} page */
async function onScreen(page) {
  return brightest(decodePng(await page.locator('#photo').screenshot()));
}

describe('the gallery', () => {
  for (const [backend, title] of [
    ['webgpu', 'WebGPU'],
    ['webgl2', 'WebGL2'],
    ['cpu', 'CPU'],
  ]) {
    test(`runs on ${backend}, and its torch follows the pointer`, async (t) => {
      const page = await openPage(t, `/?light=torch&backend=${backend}`);
      await drawn(page);
      await page.getByRole('status').getByText(`${title} (`).waitFor();
      const box = await page.locator('#photo').boundingBox();
      assert.ok(box);
      await page.mouse.move(box.x + 0.25 * box.width, box.y + 0.5 * box.height);
      const left = await onScreen(page);
      await page.mouse.move(box.x + 0.75 * box.width, box.y + 0.5 * box.height);
      const right = await onScreen(page);
      assert.ok(right.x - left.x > 0.3, `from ${left.x} to ${right.x}`);
    });
  }

  test('has a button for each light, by pointer and by key', async (t) => {
    const page = await openPage(t, '/');
    await drawn(page);
    const light = () => page.evaluate("document.getElementById('photo').light");
    assert.equal(await light(), 'fire');
    for (const name of ['Torch', 'Flood', 'Checkerboard', 'Spectrum', 'Stripes']) {
      await page.getByRole('radio', { name }).check();
      assert.equal(await light(), name.toLowerCase());
    }
    await page.keyboard.press('ArrowRight');
    assert.equal(await light(), 'checkerboard');
    assert.match(page.url(), /light=checkerboard/);
  });

  test('is lit by a picture of the visitor’s, until another light is chosen', async (t) => {
    const page = await openPage(t, '/?light=flood');
    await drawn(page);
    const before = await onScreen(page);
    // White on the left, black on the right.
    const data = Uint8Array.from({ length: 40 }, (_, i) => (i % 4 === 3 || i < 20 ? 255 : 0));
    const buffer = encodePng({ width: 10, height: 1, data });
    const file = { name: 'half.png', mimeType: 'image/png', buffer };
    await page.getByLabel('a picture or film').setInputFiles(file);
    await page.waitForFunction(() => document.querySelector('relightable-photo')?.lightSource);
    assert.equal(await page.getByRole('radio', { checked: true }).count(), 0);
    const half = await onScreen(page);
    assert.ok(half.x < before.x - 0.1, `${before.x} to ${half.x}`);
    await page.screenshot({ path: join(SCREENSHOTS, 'page-own-light.png'), fullPage: true });
    await page.getByRole('radio', { name: 'Flood' }).check();
    assert.ok((await onScreen(page)).x > half.x + 0.1);
    const odd = { name: 'odd.png', mimeType: 'image/png', buffer: Buffer.from('nothing') };
    await page.getByLabel('a picture or film').setInputFiles(odd);
    await page.getByRole('status').getByText('cannot show odd.png').waitFor();
  });

  test('is lit by a film of the visitor’s', async (t) => {
    const page = await openPage(t, '/?light=flood');
    await drawn(page);
    await page.evaluate(async () => {
      const canvas = document.createElement('canvas');
      const context = canvas.getContext('2d');
      const drawing = setInterval(() => context?.fillRect(0, 0, 9, 9), 30);
      const recorder = new MediaRecorder(canvas.captureStream(), { mimeType: 'video/webm' });
      const film = new Promise((resolve) => {
        recorder.addEventListener('dataavailable', ({ data }) => resolve(data));
      });
      recorder.start();
      setTimeout(() => recorder.stop(), 500);
      const chosen = new DataTransfer();
      chosen.items.add(new File([await film], 'fire.webm', { type: 'video/webm' }));
      clearInterval(drawing);
      const input = /** @type {HTMLInputElement} */ (document.getElementById('file'));
      input.files = chosen.files;
      input.dispatchEvent(new Event('change', { bubbles: true }));
    });
    await page.waitForFunction(
      () => document.querySelector('relightable-photo')?.lightSource instanceof HTMLVideoElement,
    );
    // Nothing but black.
    for (let i = 0; (await onScreen(page)).mean > 1; i += 1) {
      assert.ok(i < 50, 'it never became dark');
      await page.waitForTimeout(50);
    }
  });

  test('is lit by the camera, which is let go afterwards', async (t) => {
    const page = await openPage(t, '/', {
      before: () => {
        const canvas = document.createElement('canvas');
        const stream = canvas.captureStream();
        Object.assign(globalThis, { stream });
        navigator.mediaDevices.getUserMedia = async () => stream;
      },
    });
    await drawn(page);
    await page.getByRole('button', { name: 'your camera' }).click();
    await page.waitForFunction(() => document.querySelector('relightable-photo')?.lightSource);
    const state = () => page.evaluate('stream.getVideoTracks()[0].readyState');
    assert.equal(await state(), 'live');
    await page.getByRole('radio', { name: 'Stripes' }).check();
    assert.equal(await state(), 'ended');
    assert.equal(await page.evaluate("document.getElementById('photo').lightSource"), null);
  });

  test('changes the back end by its menu', async (t) => {
    const page = await openPage(t, '/');
    await drawn(page);
    await page.getByLabel('Drawn by').selectOption('CPU');
    await page
      .getByRole('status')
      .getByText(/CPU \(simd128, \d workers?\)/)
      .waitFor();
    assert.match(page.url(), /backend=cpu/);
  });

  for (const width of [390, 820, 1440]) {
    for (const colorScheme of /** @type {const} */ (['light', 'dark'])) {
      test(`fits ${width} pixels, ${colorScheme}`, async (t) => {
        const viewport = { width, height: width < 500 ? 844 : 900 };
        const page = await openPage(t, '/?light=torch', { viewport, colorScheme });
        await drawn(page);
        const room = await page.evaluate(
          'document.documentElement.scrollWidth - document.documentElement.clientWidth',
        );
        assert.equal(room, 0, 'it scrolls sideways');
        await page.screenshot({
          path: join(SCREENSHOTS, `page-${width}-${colorScheme}.png`),
          fullPage: true,
        });
      });
    }
  }

  test('looks different under every light', async (t) => {
    const page = await openPage(t, '/');
    await drawn(page);
    const means = [];
    for (const name of ['Flood', 'Torch', 'Spectrum']) {
      await page.getByRole('radio', { name }).check();
      means.push((await onScreen(page)).mean);
      await page
        .locator('.hero .frame')
        .screenshot({ path: join(SCREENSHOTS, `${name.toLowerCase()}.png`) });
    }
    const [flood = 0, torch = 0, spectrum = 0] = means;
    assert.ok(flood > spectrum && spectrum > torch && torch > 2, String(means));
  });
});
