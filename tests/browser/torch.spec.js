/** The torch follows the pointer, a finger and the arrow keys. */

import { brightest } from '../../www/tools/pictures.js';
import { expect, test } from './fixtures.js';
import { capturePicture, drag, loadPhoto, pointOf, waitForEvents } from './page-helpers.js';

const TORCH = { src: '/photos/glass.ltm', alt: 'A window', light: 'torch' };

/** @param {import('@playwright/test').Page} page */
async function enlarge(page) {
  await page.evaluate("photo.style.width = '320px'");
  return pointOf(page);
}

test.describe('the torch', () => {
  for (const backend of ['webgpu', 'webgl2', 'cpu']) {
    test(`follows the pointer on ${backend}`, async ({ openPhoto }) => {
      const page = await openPhoto({ ...TORCH, backend });
      const at = await enlarge(page);
      for (const [x, y] of /** @type {const} */ ([
        [0.25, 0.3],
        [0.75, 0.3],
        [0.75, 0.7],
        [0.25, 0.7],
      ])) {
        const point = at(x, y);
        await page.mouse.move(point.x, point.y);
        const light = brightest(await capturePicture(page));
        // The glass is coloured, so its centre of brightness is only near the torch.
        expect(Math.abs(light.x - x), `${light.x} for a torch at ${x}`).toBeLessThan(0.12);
        expect(Math.abs(light.y - y), `${light.y} for a torch at ${y}`).toBeLessThan(0.12);
      }
    });
  }

  test('moves to where a finger taps', async ({ openPhoto }) => {
    const page = await openPhoto({ ...TORCH, backend: 'cpu' }, { hasTouch: true });
    const at = await enlarge(page);
    const point = at(0.2, 0.6);
    await page.touchscreen.tap(point.x, point.y);
    expect(await page.evaluate('photo.torch')).toStrictEqual({ x: 0.2, y: 0.6 });
  });

  test('follows the mouse and the keyboard, and reports its position', async ({
    openPage,
    step,
  }) => {
    const page = await openPage('/blank');
    const mount = async (/** @type {Record<string, string>} */ attributes) => {
      // Away from the element that comes.
      await page.mouse.move(1000, 700);
      await loadPhoto(page, attributes);
    };

    await step('the torch reports its position in lightchange', async () => {
      await mount({ ...TORCH, backend: 'cpu' });
      const at = await enlarge(page);
      const point = at(0.25, 0.75);
      await page.mouse.move(point.x, point.y);
      const photoEvents = await waitForEvents(page, 'lightchange');
      expect(photoEvents.at(-1)).toStrictEqual({
        type: 'lightchange',
        light: 'torch',
        torch: { x: 0.25, y: 0.75 },
      });
    });

    await step('the torch stays at the edge of the picture when a drag leaves it', async () => {
      await mount({ ...TORCH, backend: 'cpu' });
      const at = await enlarge(page);
      await drag(page, at(0.5, 0.5), at(1.4, 0.5));
      expect(await page.evaluate('photo.torch')).toStrictEqual({ x: 1, y: 0.5 });
    });

    await step('the torch leaves vertical scrolling to the page', async () => {
      await mount({ ...TORCH, backend: 'cpu' });
      const touch = () =>
        page
          .getByRole('img', { name: 'A window' })
          .evaluate((element) => getComputedStyle(element).touchAction);
      expect(await touch()).toBe('pan-y');
      await page.evaluate("photo.light = 'flood'");
      expect(await touch()).toBe('auto');
    });

    await step('the torch moves with the arrow keys when focused', async () => {
      await mount({ ...TORCH, backend: 'cpu' });
      const before = brightest(await capturePicture(page));
      await page.keyboard.press('Tab');
      for (let i = 0; i < 5; i += 1) await page.keyboard.press('ArrowLeft');
      await page.keyboard.press('ArrowUp');
      const torch = await page.evaluate('photo.torch');
      expect(Math.abs(torch.x - 0.25)).toBeLessThan(1e-9);
      expect(Math.abs(torch.y - 0.45)).toBeLessThan(1e-9);
      const after = brightest(await capturePicture(page));
      expect(after.x, `${before.x} to ${after.x}`).toBeLessThan(before.x - 0.15);
    });

    await step('the torch accepts spaces around the light’s name', async () => {
      await mount({ ...TORCH, light: ' torch ', backend: 'cpu' });
      await page.keyboard.press('Tab');
      await page.keyboard.press('ArrowLeft');
      expect(await page.evaluate('photo.torch')).toStrictEqual({ x: 0.45, y: 0.5 });
    });

    await step('the torch does not move under other lights', async () => {
      await mount({ ...TORCH, light: 'flood', backend: 'cpu' });
      const at = await enlarge(page);
      const point = at(0.25, 0.25);
      await page.mouse.move(point.x, point.y);
      await page.keyboard.press('Tab');
      await page.keyboard.press('ArrowLeft');
      expect(await page.evaluate('photo.torch')).toBeNull();
    });
  });
});
