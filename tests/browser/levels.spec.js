/** Photographs of several levels: the element fetches and draws the parts and the level that are seen. */

import { expect, test } from './fixtures.js';
import {
  capturePicture,
  countEvents,
  mountPhoto,
  screenPicture,
  waitForEvents,
  waitForFrames,
  waitForLoad,
  waitUntil,
} from './page-helpers.js';
import { LEVELS_FILE, LIGHTS, nativePicture } from './test-photos.js';

const SRC = '/photos/levels.ltm';
const WIDTH = 523;
/** Level 0 has three shards, level 1 two. */
const FINEST = 3;
const NEXT = 2;

/** The number of shards of a level that the page shows. @param {number} level */
const shown = (level) =>
  `[...photo.shadowRoot.querySelectorAll('canvas')].filter((c) => c.style.zIndex === '${-level}').length`;

/**
 * Puts the photograph into a page at a width in CSS pixels.
 *
 * @param {import('./any-browser.js').AnyPage} page
 * @param {number} width
 * @param {Record<string, string>} [attributes]
 */
async function mountAt(page, width, attributes = {}) {
  await mountPhoto(page, { src: SRC, light: 'spectrum', ...attributes });
  await page.evaluate(`photo.style.width = '${width}px'`);
  return waitForLoad(page);
}

test.describe('a photograph of several levels', () => {
  for (const backend of ['webgpu', 'webgl2', 'cpu']) {
    test(`is drawn by ${backend} as ltm-export draws its finest level`, async ({
      openPage,
      step,
    }) => {
      const page = await openPage('/plain', { reducedMotion: 'reduce' });
      await mountAt(page, WIDTH, { backend });
      expect(await page.evaluate('[photo.info.width, photo.info.height]')).toEqual([WIDTH, 41]);
      await waitUntil(page, `${shown(0)} === ${FINEST}`);

      await step('its shards are where they belong', async () => {
        const native = nativePicture('spectrum', { photo: LEVELS_FILE });
        expect(await screenPicture(page)).toMatchPicture(native, 2);
      });

      await step('all lights agree to 1/255', async () => {
        for (const light of LIGHTS) {
          const native = nativePicture(light, { photo: LEVELS_FILE });
          expect(await capturePicture(page, { light })).toMatchPicture(native, 1);
        }
      });

      await step('the torch has the place that the root gives it', async () => {
        const torch = { x: 0.3, y: 0.65 };
        const drawn = await capturePicture(page, { light: 'torch' }, torch);
        expect(drawn).toMatchPicture(nativePicture('torch', { photo: LEVELS_FILE, torch }), 1);
      });
    });
  }

  test('is fetched as far as it is seen', async ({ openPage, server }) => {
    const page = await openPage('/plain');
    const src = `${SRC}?seen`;
    const ranges = () => server.requestedRanges.get(src) ?? [];
    await mountAt(page, WIDTH / 4, { src, zoom: '8' });
    expect(ranges(), 'the root suffices').toHaveLength(1);
    await page.evaluate('photo.view = { zoom: 2, x: 1 }');
    await waitUntil(page, `${shown(1)} === ${NEXT}`);
    expect(ranges()).toHaveLength(1 + NEXT);
    await page.evaluate('photo.viewTo({ x: 0, y: 0.4, width: 0.2, height: 0.2 }, { duration: 0 })');
    await waitUntil(page, `${shown(0)} === 1`);
    expect(await page.evaluate('photo.view.zoom')).toBeCloseTo(5);
    expect(ranges()).toHaveLength(2 + NEXT);
    await page.evaluate('photo.view = { zoom: 2, x: 1 }');
    await waitUntil(page, `${shown(1)} === ${NEXT} && ${shown(0)} === 0`);
    expect(ranges(), 'shards stay in memory').toHaveLength(2 + NEXT);
  });

  test('is fetched as far as object-fit shows it', async ({ openPage, server }) => {
    const page = await openPage('/plain');
    const src = `${SRC}?cover`;
    await mountAt(page, WIDTH / 4, { src });
    await page.evaluate(
      "Object.assign(photo.style, { width: '80px', height: '80px', objectFit: 'cover', objectPosition: '0 0' })",
    );
    await waitUntil(page, `${shown(0)} === 1`);
    // The root, one shard, and one of the coarser level.
    expect(server.requestedRanges.get(src)).toHaveLength(3);
    await page.evaluate("photo.style.objectPosition = '100% 0'");
    await waitUntil(page, `${shown(0)} === 2`);
  });

  test('has the light of the moment also where it was out of view', async ({ openPage }) => {
    const page = await openPage('/plain', { reducedMotion: 'reduce' });
    await mountAt(page, WIDTH, { backend: 'cpu', zoom: '16' });
    await waitUntil(page, `${shown(0)} === ${FINEST}`);
    for (const [light, x] of /** @type {const} */ ([
      ['flood', 0],
      ['stripes', 1],
      ['checkerboard', 0.4],
    ])) {
      await page.evaluate(`photo.view = { zoom: 16, x: ${x} }`);
      await page.evaluate(`photo.light = '${light}'`);
      await waitForFrames(page, 2);
    }
    await page.evaluate('photo.view = { zoom: 1 }');
    await waitUntil(page, `${shown(0)} === ${FINEST}`);
    const native = nativePicture('checkerboard', { photo: LEVELS_FILE });
    await expect(async () => {
      expect(await screenPicture(page)).toMatchPicture(native, 2);
    }).toPass();
  });

  test('shows its last level where a server sends no ranges', async ({ openPage }) => {
    const page = await openPage('/plain');
    await mountAt(page, WIDTH, { src: '/fixtures/format/levels.ltm' });
    const warnings = await waitForEvents(page, 'warning');
    const warning = warnings.find(({ type }) => type === 'warning');
    expect(warning?.['code']).toBe('http-range');
    expect(warning?.['message']).toContain('must support range requests');
    expect(await page.evaluate(shown(0))).toBe(0);
    expect(await countEvents(page, 'error')).toBe(0);
  });

  test('shows its last level without the script for levels', async ({ openPage }) => {
    const page = await openPage('/plain');
    await page.route('**/relightable-photo-levels.js', (route) => route.abort());
    await mountAt(page, WIDTH);
    expect(await countEvents(page, 'error')).toBe(0);
    expect((await screenPicture(page)).width).toBe(WIDTH);
  });

  test('is drawn again after its workers are lost', async ({ openPage }) => {
    const page = await openPage('/plain', {
      before: () => {
        const workers = /** @type {Worker[]} */ ([]);
        const { Worker } = globalThis;
        globalThis.Worker = class extends Worker {
          /** @param {ConstructorParameters<typeof Worker>} args */
          constructor(...args) {
            super(...args);
            workers.push(this);
          }
        };
        Object.assign(globalThis, { workers });
      },
    });
    await mountAt(page, WIDTH, { backend: 'cpu' });
    await waitUntil(page, `${shown(0)} === ${FINEST}`);
    await page.evaluate(
      'for (const worker of workers) worker.dispatchEvent(new ErrorEvent("error", { message: "gone" }))',
    );
    const native = nativePicture('stripes', { photo: LEVELS_FILE });
    await page.evaluate("photo.light = 'stripes'");
    await expect(async () => {
      expect(await screenPicture(page)).toMatchPicture(native, 2);
    }).toPass();
  });
});
