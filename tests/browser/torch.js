/** The torch follows pointer, finger and keys. */

import assert from 'node:assert/strict';
import { describe, test } from 'node:test';
import { brightest } from '../../www/tools/pictures.js';
import { happenedUntil, loaded, mount, openPage, picture } from './browser.js';

const TORCH = { src: '/photos/glass.ltm', alt: 'A window', light: 'torch' };

/** @param {import('playwright-core').Page} page */
async function enlarged(page) {
  await page.evaluate("photo.style.width = '320px'");
  const box = await page.getByRole('img', { name: 'A window' }).boundingBox();
  assert.ok(box);
  return (/** @type {number} */ x, /** @type {number} */ y) => ({
    x: box.x + x * box.width,
    y: box.y + y * box.height,
  });
}

describe('the torch', () => {
  for (const backend of ['webgpu', 'webgl2', 'cpu']) {
    test(`follows the pointer on ${backend}`, async (t) => {
      const page = await openPage(t, '/bench');
      await mount(page, { ...TORCH, backend });
      await loaded(page);
      const at = await enlarged(page);
      for (const [x, y] of /** @type {const} */ ([
        [0.25, 0.3],
        [0.75, 0.3],
        [0.75, 0.7],
        [0.25, 0.7],
      ])) {
        const point = at(x, y);
        await page.mouse.move(point.x, point.y);
        const light = brightest(await picture(page));
        // The glass has colours of its own, so the brightness lies near the torch, not just there.
        assert.ok(Math.abs(light.x - x) < 0.12, `${light.x} for a torch at ${x}`);
        assert.ok(Math.abs(light.y - y) < 0.12, `${light.y} for a torch at ${y}`);
      }
    });
  }

  test('tells where it is', async (t) => {
    const page = await openPage(t, '/bench');
    await mount(page, { ...TORCH, backend: 'cpu' });
    await loaded(page);
    const at = await enlarged(page);
    const point = at(0.25, 0.75);
    await page.mouse.move(point.x, point.y);
    const happened = await happenedUntil(page, 'lightchange');
    assert.deepEqual(happened.at(-1), {
      type: 'lightchange',
      light: 'torch',
      torch: { x: 0.25, y: 0.75 },
    });
  });

  test('stays at the edge when a drag leaves the picture', async (t) => {
    const page = await openPage(t, '/bench');
    await mount(page, { ...TORCH, backend: 'cpu' });
    await loaded(page);
    const at = await enlarged(page);
    const [from, to] = [at(0.5, 0.5), at(1.4, 0.5)];
    await page.mouse.move(from.x, from.y);
    await page.mouse.down();
    await page.mouse.move(to.x, to.y);
    await page.mouse.up();
    assert.deepEqual(await page.evaluate('photo.torch'), { x: 1, y: 0.5 });
  });

  test('follows a finger', async (t) => {
    const page = await openPage(t, '/bench', { hasTouch: true });
    await mount(page, { ...TORCH, backend: 'cpu' });
    await loaded(page);
    const at = await enlarged(page);
    const point = at(0.2, 0.6);
    await page.touchscreen.tap(point.x, point.y);
    assert.deepEqual(await page.evaluate('photo.torch'), { x: 0.2, y: 0.6 });
  });

  test('leaves up and down to the page’s own scrolling', async (t) => {
    const page = await openPage(t, '/bench');
    await mount(page, { ...TORCH, backend: 'cpu' });
    await loaded(page);
    const touch = () =>
      page
        .getByRole('img', { name: 'A window' })
        .evaluate((element) => getComputedStyle(element).touchAction);
    assert.equal(await touch(), 'pan-y');
    await page.evaluate("photo.light = 'flood'");
    assert.equal(await touch(), 'auto');
  });

  test('is moved by the arrow keys, once focused', async (t) => {
    const page = await openPage(t, '/bench');
    await mount(page, { ...TORCH, backend: 'cpu' });
    await loaded(page);
    const before = brightest(await picture(page));
    await page.keyboard.press('Tab');
    for (let i = 0; i < 5; i += 1) await page.keyboard.press('ArrowLeft');
    await page.keyboard.press('ArrowUp');
    const torch = await page.evaluate('photo.torch');
    assert.ok(Math.abs(torch.x - 0.25) < 1e-9 && Math.abs(torch.y - 0.45) < 1e-9);
    const after = brightest(await picture(page));
    assert.ok(after.x < before.x - 0.15, `${before.x} to ${after.x}`);
  });

  test('is held where spaces stand around its name', async (t) => {
    const page = await openPage(t, '/bench');
    await mount(page, { ...TORCH, light: ' torch ', backend: 'cpu' });
    await loaded(page);
    await page.keyboard.press('Tab');
    await page.keyboard.press('ArrowLeft');
    assert.deepEqual(await page.evaluate('photo.torch'), { x: 0.45, y: 0.5 });
  });

  test('is not held under other lights', async (t) => {
    const page = await openPage(t, '/bench');
    await mount(page, { ...TORCH, light: 'flood', backend: 'cpu' });
    await loaded(page);
    const at = await enlarged(page);
    const point = at(0.25, 0.25);
    await page.mouse.move(point.x, point.y);
    await page.keyboard.press('Tab');
    await page.keyboard.press('ArrowLeft');
    assert.equal(await page.evaluate('photo.torch'), null);
  });
});
