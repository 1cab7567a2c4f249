/** OpenSeadragon shows a photograph, whose tiles are drawn under the light of the moment. */

import { compare } from '../../www/tools/pictures.js';
import { expect, test } from './fixtures.js';
import { screenPicture, waitUntil } from './page-helpers.js';
import { LEVELS_FILE, nativePicture } from './test-photos.js';

/** The image of the viewer has all tiles that it needs. */
const LOADED = 'globalThis.viewer?.world.getItemAt(0)?.getFullyLoaded() === true';
/** Where tiles are resampled. */
const MIN_PSNR_DB = 24;

/**
 * Opens a viewer over a photograph, with its pixels on those of the box. The page's globals are then `tiles` and `viewer`.
 *
 * @param {import('@playwright/test').Page} page
 * @param {Record<string, unknown>} options of `openTiles`
 * @param {string} [drawer]
 * @param {string} [src]
 */
function openViewer(page, options, drawer = 'canvas', src = '/photos/levels.ltm') {
  return page.evaluate(
    async ({ options, drawer, src }) => {
      const module = '/relightable-photo/openseadragon.js';
      const { openTiles } = await import(module);
      const tiles = await openTiles(src, options);
      const viewer = /** @type {any} */ (globalThis).OpenSeadragon({
        element: document.querySelector('#viewer'),
        tileSources: tiles.tileSource,
        drawer,
        showNavigationControl: false,
        animationTime: 0,
        immediateRender: true,
        imageSmoothingEnabled: false,
      });
      Object.assign(globalThis, { tiles, viewer });
    },
    { options, drawer, src },
  );
}

test.describe('OpenSeadragon', () => {
  for (const drawer of ['canvas', 'webgl']) {
    test(`shows a photograph of several levels with its drawer ${drawer}`, async ({
      openPage,
      server,
      step,
    }) => {
      const page = await openPage('/viewer');
      await openViewer(page, { light: 'spectrum' }, drawer);
      await waitUntil(page, LOADED);
      const shows = async (/** @type {ReturnType<typeof nativePicture>} */ picture) => {
        const screen = await screenPicture(page, '#viewer');
        if (drawer === 'webgl') expect(screen).toMatchPicture(picture, 2);
        // It makes each tile a pixel larger, against gaps.
        else expect(compare(screen, picture).psnr).toBeGreaterThan(MIN_PSNR_DB);
      };

      await step('the tiles are where they belong', async () => {
        await expect(() => shows(nativePicture('spectrum', { photo: LEVELS_FILE }))).toPass();
      });

      await step('they are drawn again under another light, and not fetched again', async () => {
        const fetched = () => server.requestedRanges.get('/photos/levels.ltm')?.length;
        const before = fetched();
        await page.evaluate("tiles.setLight('stripes')");
        await expect(() => shows(nativePicture('stripes', { photo: LEVELS_FILE }))).toPass();
        const torch = { x: 0.3, y: 0.65 };
        // The first of them are replaced before they are drawn.
        await page.evaluate((torch) => {
          const { tiles } = /** @type {any} */ (globalThis);
          for (const x of [0.1, 0.2]) tiles.setLight({ name: 'torch', ...torch, x });
          return tiles.setLight({ name: 'torch', ...torch });
        }, torch);
        await expect(() => shows(nativePicture('torch', { photo: LEVELS_FILE, torch }))).toPass();
        expect(fetched()).toBe(before);
      });

      await step('the exposure is as elsewhere', async () => {
        await page.evaluate(
          "tiles.setLight('flood').then(() => tiles.setOutput({ exposure: 0.5 }))",
        );
        const native = nativePicture('flood', { photo: LEVELS_FILE, exposure: 0.5 });
        await expect(() => shows(native)).toPass();
      });

      await step('tiles that come into view later have the light of that time', async () => {
        await page.evaluate('tiles.setOutput({})');
        await page.evaluate('viewer.viewport.zoomTo(4, null, true)');
        await waitUntil(page, LOADED);
        await page.evaluate("tiles.setLight('stripes')");
        await page.evaluate('viewer.viewport.goHome(true)');
        await waitUntil(page, LOADED);
        await expect(() => shows(nativePicture('stripes', { photo: LEVELS_FILE }))).toPass();
      });
    });
  }

  test('fetches the shards that it shows, and those again whose memory is needed', async ({
    openPage,
    server,
  }) => {
    const page = await openPage('/viewer');
    const src = '/photos/levels.ltm?small';
    // Not enough for two shards.
    await openViewer(page, { maxBytes: 1 }, 'webgl', src);
    await waitUntil(page, LOADED);
    const fetched = () => server.requestedRanges.get(src)?.length ?? 0;
    const before = fetched();
    expect(before, 'the root, and the shards of both levels').toBe(6);
    await page.evaluate("tiles.setLight('stripes')");
    expect(fetched()).toBeGreaterThan(before);
  });

  test('reports tiles that cannot be drawn again, and draws them once they can', async ({
    openPage,
  }) => {
    const page = await openPage('/viewer');
    await openViewer(page, { maxBytes: 1 }, 'webgl');
    await waitUntil(page, LOADED);
    const setLight = (/** @type {string} */ light) =>
      page.evaluate(`tiles.setLight('${light}').then(() => '', (error) => error.code)`);
    await page.route('**/photos/levels.ltm', (route) => route.abort());
    expect(await setLight('stripes')).toBe('http-network');
    await page.unroute('**/photos/levels.ltm');
    expect(await setLight('spectrum')).toBe('');
    const native = nativePicture('spectrum', { photo: LEVELS_FILE });
    await expect(async () => {
      expect(await screenPicture(page, '#viewer')).toMatchPicture(native, 2);
    }).toPass();
  });

  test('shows a photograph of one level', async ({ openPage }) => {
    const page = await openPage('/viewer');
    await page.evaluate(
      "Object.assign(document.querySelector('#viewer').style, { width: '64px', height: '64px' })",
    );
    await openViewer(page, { light: 'torch' }, 'webgl', '/photos/glass.ltm');
    await waitUntil(page, LOADED);
    await expect(async () => {
      expect(await screenPicture(page, '#viewer')).toMatchPicture(nativePicture('torch'), 2);
    }).toPass();
    expect(await page.evaluate('[tiles.info.width, viewer.world.getItemCount()]')).toEqual([64, 1]);
    await page.evaluate('viewer.destroy(); tiles.setLight("flood").then(() => tiles.free())');
  });

  test('reports what is wrong', async ({ openPage }) => {
    const page = await openPage('/viewer');
    /** @param {string} src @param {unknown} [light] */
    const failure = (src, light) =>
      page.evaluate(
        async ({ src, light }) => {
          const module = '/relightable-photo/openseadragon.js';
          const { openTiles } = await import(module);
          return openTiles(src, light ? { light } : {}).then(
            () => '',
            (/** @type {any} */ error) => error.code ?? error.name,
          );
        },
        { src, light },
      );
    expect(await failure('/faults/status')).toBe('http-status');
    expect(await failure('/photos/not-ltm.ltm')).toBe('format-magic');
    expect(await failure('/photos/levels.ltm', 'moon')).toBe('attribute');
    expect(await failure('/photos/levels.ltm', { name: 'torch', x: 'left' })).toBe('TypeError');
    expect(await failure('/photos/levels.ltm', { image: 1 })).toBe('TypeError');
    await openViewer(page, {}, 'canvas', '/fixtures/format/levels.ltm');
    // The last level suffices for the overview; a finer one needs ranges.
    const message = await page.evaluate(
      () =>
        new Promise((resolve) => {
          const { viewer } = /** @type {any} */ (globalThis);
          viewer.addHandler('tile-load-failed', (/** @type {any} */ event) =>
            resolve(event.message),
          );
        }),
    );
    expect(message).toContain('range');
  });
});
