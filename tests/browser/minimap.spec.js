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

  test('of a photograph of several levels has the light of the moment everywhere', async ({
    openPage,
  }) => {
    const page = await openPage('/plain', { reducedMotion: 'reduce' });
    await mount(page, { backend: 'cpu', src: '/photos/levels.ltm', zoom: '16', light: 'flood' });
    await page.evaluate("photo.style.width = '523px', photo.view = { zoom: 16, x: 0.1 }");
    await waitUntil(page, IS_SHOWN);
    // The brightest code of the right half, which is out of view.
    const brightness = `(() => {
      const { width, height } = ${MINIMAP}.querySelector('canvas');
      const context = ${MINIMAP}.querySelector('canvas').getContext('2d');
      const { data } = context.getImageData(width / 2, 0, width / 2, height);
      return Math.max(...data.filter((_, i) => i % 4 < 3));
    })()`;
    expect(await page.evaluate(brightness)).toBeGreaterThan(60);
    // Frames of a moving light are drawn in view only, but for the overview.
    const isDark = await page.evaluate(`(async () => {
      photo.light = 'torch';
      for (let i = 0; i < 1000; i += 1) {
        photo.torch = { x: 0.1 + 0.01 * (i % 2), y: 0.5 };
        await new Promise(requestAnimationFrame);
        if (${brightness} < 12) return true;
      }
      return false;
    })()`);
    expect(isDark).toBe(true);
  });

  test('frames what object-fit leaves of the picture', async ({ openPage }) => {
    const page = await openPage('/plain', { reducedMotion: 'reduce' });
    await mount(page, { backend: 'cpu', src: '/photos/levels.ltm' });
    await page.evaluate(
      "Object.assign(photo.style, { width: '600px', height: '600px', objectFit: 'cover' })",
    );
    await page.evaluate('photo.view = { zoom: 2 }');
    await waitUntil(page, IS_SHOWN);
    const { map, frame } = await boxesOf(page);
    // A half of 41 of 523 columns are seen.
    expect(frame.width / map.width).toBeCloseTo(41 / 523 / 2, 2);
    await page.mouse.click(map.x + 0.4 * map.width, map.y + map.height / 2);
    const moved = (await boxesOf(page)).frame;
    expect((moved.x + moved.width / 2 - map.x) / map.width).toBeCloseTo(0.4, 1);
    await page.evaluate("photo.style.height = '300px'");
    await waitUntil(
      page,
      `${MINIMAP}.querySelector('.minimap-frame').offsetWidth > 1.5 * ${frame.width}`,
    );
    expect(map.width / map.height, 'the overview keeps its shape').toBeGreaterThan(8);
  });

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
    const events = await waitForEvents(page, 'warning');
    const warning = events.find(({ type }) => type === 'warning');
    expect(warning?.['code']).toBe('minimap-unavailable');
    expect(await page.evaluate('photo.view.zoom')).toBe(2);
  });
});
