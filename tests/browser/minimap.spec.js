/** The overview of a magnified picture. */

import { expect, test } from './fixtures.js';
import {
  decodeDataUrl,
  mountPhoto,
  waitForEvents,
  waitForFrames,
  waitForLoad,
  waitUntil,
} from './page-helpers.js';
import { nativePicture } from './test-photos.js';

/** @typedef {import('@playwright/test').Page} Page */

const MINIMAP = "photo.shadowRoot.querySelector('[part=minimap]')";
const IS_SHOWN = `${MINIMAP}?.checkVisibility() === true`;

/** @param {Page} page @param {Record<string, string>} attributes */
async function mount(page, attributes) {
  await mountPhoto(page, { src: '/photos/glass.ltm', zoom: '', minimap: '', ...attributes });
  await page.evaluate("photo.style.width = '400px'");
  await waitForLoad(page);
}

/** The overview's box on the page, and that of the frame in it. @param {Page} page */
const boxesOf = async (page) =>
  /** @type {{ map: DOMRect, frame: DOMRect }} */ (
    await page.evaluate(`({
      map: ${MINIMAP}.querySelector('canvas').getBoundingClientRect().toJSON(),
      frame: ${MINIMAP}.querySelector('.minimap-frame').getBoundingClientRect().toJSON(),
    })`)
  );

test.describe('the overview', () => {
  for (const backend of ['webgpu', 'webgl2', 'cpu']) {
    test(`shows what ${backend} draws, and the part in view`, async ({ openPage }) => {
      const page = await openPage('/plain', { reducedMotion: 'reduce' });
      await mount(page, { backend, light: 'flood' });
      await waitForFrames(page);
      expect(await page.evaluate(IS_SHOWN), 'the whole picture needs none').toBe(false);
      await page.evaluate('photo.view = { zoom: 4, x: 0.25, y: 0.75 }');
      await waitUntil(page, IS_SHOWN);
      const drawn = async () =>
        decodeDataUrl(
          String(await page.evaluate(`${MINIMAP}.querySelector('canvas').toDataURL()`)),
        );
      await expect(async () => {
        expect(await drawn()).toMatchPicture(nativePicture('flood'), 2);
      }).toPass();
      const { map, frame } = await boxesOf(page);
      expect(frame.width / map.width).toBeCloseTo(1 / 4, 1);
      expect((frame.x - map.x) / map.width).toBeCloseTo(1 / 8, 1);
      expect((frame.y - map.y) / map.height).toBeCloseTo(5 / 8, 1);
      await page.evaluate("photo.light = 'stripes'");
      await expect(async () => {
        expect(await drawn()).toMatchPicture(nativePicture('stripes'), 2);
      }).toPass();
      await page.evaluate('photo.view = { zoom: 1 }');
      await waitUntil(page, `!(${IS_SHOWN})`);
    });
  }

  test('moves the view to where a visitor points', async ({ openPage }) => {
    const page = await openPage('/plain', { reducedMotion: 'reduce' });
    await mount(page, { backend: 'cpu', light: 'torch' });
    await page.evaluate('photo.view = { zoom: 4, x: 0.5, y: 0.5 }');
    await waitUntil(page, `${IS_SHOWN} && ${MINIMAP}.querySelector('canvas').width > 1`);
    const { map } = await boxesOf(page);
    await page.mouse.move(map.x + 0.3 * map.width, map.y + 0.6 * map.height);
    expect(await page.evaluate('photo.view.x'), 'without a press nothing moves').toBe(0.5);
    await page.mouse.down();
    expect(await page.evaluate('photo.view.x')).toBeCloseTo(0.3, 1);
    await page.mouse.move(map.x + 0.7 * map.width, map.y + 0.4 * map.height);
    await page.mouse.up();
    const view = /** @type {{ zoom: number, x: number, y: number }} */ (
      await page.evaluate('photo.view')
    );
    expect(view.zoom).toBe(4);
    expect(view.x).toBeCloseTo(0.7, 1);
    expect(view.y).toBeCloseTo(0.4, 1);
    expect(await page.evaluate('photo.torch'), 'the light stays').toBeNull();
    await page.evaluate("photo.removeAttribute('minimap')");
    await waitUntil(page, `!(${IS_SHOWN})`);
  });

  test('without its script causes minimap-unavailable and still zooms', async ({ openPage }) => {
    const page = await openPage('/plain');
    await page.route('**/relightable-photo-minimap.js', (route) => route.abort());
    await mount(page, { backend: 'cpu' });
    await page.evaluate('photo.view = { zoom: 2 }');
    const warnings = await waitForEvents(page, 'warning');
    expect(warnings.at(-1)?.['code']).toBe('minimap-unavailable');
    expect(await page.evaluate('photo.view.zoom')).toBe(2);
  });
});
