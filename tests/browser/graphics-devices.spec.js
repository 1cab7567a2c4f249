/** All photographs of a page share one graphics device, which is replaced after a loss. */

import { decodePng } from '../../www/tools/pictures.js';
import { expect, test } from './fixtures.js';
import {
  capturePicture,
  mountPhoto,
  waitForEvents,
  waitForFrames,
  waitForLoad,
  waitUntil,
} from './page-helpers.js';
import { nativePicture } from './test-photos.js';

const GLASS = { src: '/photos/glass.ltm', light: 'spectrum' };
/** More than the sixteen WebGL contexts that Chromium allows for a page. */
const PHOTOS = 24;

/** For `before` of `openPage`: `devices` has the WebGPU devices and WebGL2 contexts of the page, in order. */
function recordDevices() {
  /** @type {{ lose(): void; isLost(): boolean }[]} */
  const devices = [];
  Object.assign(globalThis, { devices });
  const adapter = /** @type {any} */ (globalThis).GPUAdapter.prototype;
  const { requestDevice } = adapter;
  adapter.requestDevice = /** @this {any} @param {any[]} options */ async function (...options) {
    const device = await Reflect.apply(requestDevice, this, options);
    let lost = false;
    device.lost.then(() => {
      lost = true;
    });
    devices.push({ lose: () => device.destroy(), isLost: () => lost });
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
          isLost: () => context.isContextLost(),
        });
      }
      return context;
    }
  );
}

/** @param {import('./page-helpers.js').ElementEvent[]} photoEvents */
const backendChanges = (photoEvents) =>
  photoEvents.filter((event) => event.type === 'backendchange');

/** @param {import('@playwright/test').Page} page */
async function expectSpectrum(page) {
  expect(await capturePicture(page)).toMatchPicture(nativePicture('spectrum'), 1);
}

test.describe('graphics devices', () => {
  for (const [backend, probes] of /** @type {const} */ ([
    ['webgpu', 0],
    // A context that only reads the renderer's name, and is released.
    ['webgl2', 1],
  ])) {
    test(`${PHOTOS} photographs share one ${backend} device, which is released with the last of them`, async ({
      openPage,
    }) => {
      test.slow();
      const page = await openPage('/plain', { before: recordDevices });
      const pictures = await page.evaluate(
        async ({ src, backend, count }) => {
          const photos = Array.from({ length: count }, (_, i) => {
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
        { src: GLASS.src, backend, count: PHOTOS },
      );
      expect(await page.evaluate('devices.length')).toBe(probes + 1);
      expect(new Set(pictures).size, 'one picture for each of two lights').toBe(2);
      const first = Buffer.from(pictures[0]?.split(',').map(Number) ?? []);
      const want = nativePicture('spectrum');
      expect(decodePng(first)).toMatchPicture(want, 1);
      await page.evaluate('photos.slice(1).forEach((photo) => photo.remove())');
      await waitForFrames(page);
      expect(await page.evaluate('devices.at(-1).isLost()')).toBe(false);
      await page.evaluate('photos[0].remove()');
      await waitUntil(page, 'devices.at(-1).isLost()');
    });

    test(`a lost ${backend} device is replaced without a new transfer`, async ({
      openPage,
      server,
    }) => {
      const page = await openPage('/plain', { before: recordDevices });
      const src = `${GLASS.src}?for=${test.info().testId}`;
      // Alone, as a busy machine may need more than the ten seconds after which the next backend is tried.
      await mountPhoto(page, { ...GLASS, src, backend });
      await waitForLoad(page);
      const fetched = server.requestedRanges.get(src)?.length;
      for (let time = 1; time <= 3; time += 1) {
        if (time === 3) await page.evaluate(`photo.backend = '${backend} cpu'`);
        // No change of the light or of the view requests a frame.
        await page.evaluate('devices.at(-1).lose()');
        const change = backendChanges(await waitForEvents(page, 'backendchange', time + 1)).at(-1);
        expect(change?.['previous']).toBe(backend);
        // After the third loss the next backend is used.
        expect(change?.['backend']).toBe(time < 3 ? backend : 'cpu');
        expect(String(change?.['reason'])).toMatch(/was lost/);
        await expectSpectrum(page);
      }
      // The renderer's name is read again after each loss.
      expect(await page.evaluate('devices.length')).toBe(3 * (probes + 1));
      expect(server.requestedRanges.get(src)?.length, 'the file is not requested again').toBe(
        fetched,
      );
    });
  }
});
