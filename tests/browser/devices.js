/** One device serves a whole page; one that is lost is made anew, until it is lost too often. */

import assert from 'node:assert/strict';
import { describe, test } from 'node:test';
import { compare, decodePng } from '../../www/tools/pictures.js';
import { asked, happenedUntil, loaded, mount, openPage, picture } from './browser.js';
import { nativePicture } from './photos.js';

const GLASS = { src: '/photos/glass.ltm', light: 'spectrum' };

/** Notes all devices and contexts of a page, in `globalThis.devices`. */
function noteDevices() {
  /** @type {{ lose(): void; gone(): boolean }[]} */
  const devices = [];
  Object.assign(globalThis, { devices });
  const adapter = /** @type {any} */ (globalThis).GPUAdapter.prototype;
  const { requestDevice } = adapter;
  adapter.requestDevice = /** @this {any} @param {any[]} options */ async function (...options) {
    const device = await Reflect.apply(requestDevice, this, options);
    let gone = false;
    device.lost.then(() => {
      gone = true;
    });
    devices.push({ lose: () => device.destroy(), gone: () => gone });
    return device;
  };
  const { getContext } = HTMLCanvasElement.prototype;
  const known = new Set();
  HTMLCanvasElement.prototype.getContext = /** @type {any} */ (
    /** @this {HTMLCanvasElement} @param {string} kind @param {any[]} rest */
    function (kind, ...rest) {
      const context = Reflect.apply(getContext, this, [kind, ...rest]);
      if (kind === 'webgl2' && !known.has(context)) {
        known.add(context);
        const extension = context.getExtension('WEBGL_lose_context');
        devices.push({
          lose: () => extension.loseContext(),
          gone: () => context.isContextLost(),
        });
      }
      return context;
    }
  );
}

/** @param {import('./browser.js').Happening[]} happened */
const changes = (happened) => happened.filter((event) => event.type === 'backendchange');

/** @param {import('playwright-core').Page} page */
async function drawsRight(page) {
  assert.ok(compare(await picture(page), nativePicture('spectrum', 'reference')).worst <= 1);
}

describe('graphics devices', () => {
  for (const [backend, named] of /** @type {const} */ ([
    ['webgpu', 0],
    // One that only tells what devices are called, and is let go.
    ['webgl2', 1],
  ])) {
    test(`64 photographs share one of ${backend}, which goes with the last`, async (t) => {
      const page = await openPage(t, '/bench', { before: noteDevices });
      const pictures = await page.evaluate(
        async ({ src, backend }) => {
          const photos = Array.from({ length: 64 }, (_, i) => {
            const photo = /** @type {any} */ (document.createElement('relightable-photo'));
            photo.loading = 'eager';
            photo.style.width = '40px';
            photo.style.display = 'inline-block';
            photo.light = ['spectrum', 'torch'][i % 2];
            photo.backend = backend;
            photo.src = src;
            return photo;
          });
          const loads = photos.map(
            (photo) =>
              new Promise((resolve, reject) => {
                photo.addEventListener('load', resolve);
                photo.addEventListener('error', reject);
              }),
          );
          document.body.append(...photos);
          await Promise.all(loads);
          Object.assign(globalThis, { photos });
          const blobs = await Promise.all(photos.map((photo) => photo.toBlob()));
          const texts = blobs.map(async (blob) => new Uint8Array(await blob.arrayBuffer()).join());
          return Promise.all(texts);
        },
        { src: GLASS.src, backend },
      );
      assert.equal(await page.evaluate('devices.length'), named + 1);
      assert.equal(new Set(pictures).size, 2, 'each draws its own light, and all draw alike');
      const first = Buffer.from(pictures[0]?.split(',').map(Number) ?? []);
      const want = nativePicture('spectrum', 'reference');
      assert.ok(compare(decodePng(first), want).worst <= 1);
      await page.evaluate('photos.slice(1).forEach((photo) => photo.remove())');
      await page.waitForTimeout(200);
      assert.equal(await page.evaluate('devices.at(-1).gone()'), false);
      await page.evaluate('photos[0].remove()');
      await page.waitForFunction('devices.at(-1).gone()');
    });

    test(`a loss of ${backend} is made good for all, from what is there`, async (t) => {
      const page = await openPage(t, '/bench', { before: noteDevices });
      const src = `${GLASS.src}?for=${encodeURIComponent(t.name)}`;
      await mount(page, { ...GLASS, src, backend: `${backend} cpu` });
      await loaded(page);
      const fetched = asked.get(src)?.length;
      for (let time = 1; time <= 3; time += 1) {
        // Nothing asks for another drawing.
        await page.evaluate('devices.at(-1).lose()');
        const change = changes(await happenedUntil(page, 'backendchange', time + 1)).at(-1);
        assert.equal(change?.['previous'], backend);
        // Too often is too often.
        assert.equal(change?.['backend'], time < 3 ? backend : 'cpu');
        assert.match(String(change?.['reason']), /was lost/);
        await drawsRight(page);
      }
      // What comes in the place of one that is lost is asked its name as well.
      assert.equal(await page.evaluate('devices.length'), 3 * (named + 1));
      assert.equal(asked.get(src)?.length, fetched, 'nothing is fetched again');
    });
  }
});
