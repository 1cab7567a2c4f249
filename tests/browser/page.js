/** The demo page, as visitors meet it. */

import assert from 'node:assert/strict';
import { join } from 'node:path';
import { describe, test } from 'node:test';
import { brightest, decodePng } from '../../www/tools/pictures.js';
import { openPage } from './browser.js';
import { SCREENSHOTS } from './photos.js';

/** @param {import('playwright-core').Page} page */
async function drawn(page) {
  await page.waitForFunction(() => document.querySelector('relightable-photo')?.activeBackend);
  await page.locator('relightable-photo canvas').waitFor();
}

/** @param {import('playwright-core').Page} page */
async function onScreen(page) {
  return brightest(decodePng(await page.locator('relightable-photo').screenshot()));
}

describe('the demo page', () => {
  for (const [backend, title] of [
    ['webgpu', 'WebGPU'],
    ['webgl2', 'WebGL2'],
    ['cpu', 'CPU'],
  ]) {
    test(`runs on ${backend}, and its torch follows the pointer`, async (t) => {
      const page = await openPage(t, `/?backend=${backend}`);
      await drawn(page);
      await page.getByRole('status').getByText(`${title} (`).waitFor();
      const box = await page.locator('relightable-photo').boundingBox();
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
    const light = () => page.evaluate("document.querySelector('relightable-photo').light");
    assert.equal(await light(), 'torch');
    for (const name of ['Flood', 'Checkerboard', 'Stripes', 'Spectrum', 'Torch']) {
      await page.getByRole('radio', { name }).check();
      assert.equal(await light(), name.toLowerCase());
    }
    await page.keyboard.press('ArrowRight');
    assert.equal(await light(), 'checkerboard');
    assert.match(page.url(), /light=checkerboard/);
  });

  test('changes the back end by its menu', async (t) => {
    const page = await openPage(t, '/');
    await drawn(page);
    await page.getByLabel('Drawn by').selectOption('CPU');
    await page.getByRole('status').getByText('CPU (simd128)').waitFor();
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
        .locator('.frame')
        .screenshot({ path: join(SCREENSHOTS, `${name.toLowerCase()}.png`) });
    }
    const [flood = 0, torch = 0, spectrum = 0] = means;
    assert.ok(flood > spectrum && spectrum > torch && torch > 2, String(means));
  });
});
