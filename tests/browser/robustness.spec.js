/** Many elements on a page; a network that is off or slow. */

import { expect, note, test } from './fixtures.js';
import { capturePicture, mountPhoto, waitForEvents, waitForLoad } from './page-helpers.js';
import { glassBytes, nativePicture } from './test-photos.js';

const SRC = '/photos/glass.ltm';
const ELEMENTS = 16;
/** 1 Mbit/s, in bytes a second. */
const SLOW_NETWORK = 1e6 / 8;

/** For `before` of `openPage`: counts the WebGPU devices and WebGL2 contexts that the page creates. */
const countDevices = () => {
  const created = { devices: 0, contexts: 0 };
  Object.assign(globalThis, { created });
  const adapter = /** @type {any} */ (globalThis).GPUAdapter.prototype;
  const { requestDevice } = adapter;
  adapter.requestDevice = /** @this {any} @param {any[]} args */ function (...args) {
    created.devices += 1;
    return Reflect.apply(requestDevice, this, args);
  };
  const { getContext } = HTMLCanvasElement.prototype;
  HTMLCanvasElement.prototype.getContext = /** @type {any} */ (
    /** @this {HTMLCanvasElement} @param {string} kind @param {any[]} rest */
    function (kind, ...rest) {
      if (kind === 'webgl2') created.contexts += 1;
      return Reflect.apply(getContext, this, [kind, ...rest]);
    }
  );
};

test.describe('sixteen elements', () => {
  for (const [backend, devices] of /** @type {const} */ ([
    ['webgpu', { devices: 1, contexts: 0 }],
    // One of the contexts only reads the renderer's name.
    ['webgl2', { devices: 0, contexts: 2 }],
    ['cpu', { devices: 0, contexts: 0 }],
  ])) {
    test(`share devices and workers on ${backend}`, async ({ openPage }) => {
      const page = await openPage('/plain', { before: countDevices });
      const workers = await page.evaluate(
        async ({ src, backend, count }) => {
          await customElements.whenDefined('relightable-photo');
          const loads = Array.from({ length: count }, (_, i) => {
            const photo = document.createElement('relightable-photo');
            Object.assign(photo, {
              src: `${src}?${i}`,
              backend,
              light: 'spectrum',
              loading: 'eager',
            });
            photo.style.width = '64px';
            const load = new Promise((resolve, reject) => {
              photo.addEventListener('load', resolve);
              photo.addEventListener('error', ({ message }) => reject(new Error(message)));
            });
            document.body.append(photo);
            return load;
          });
          await Promise.all(loads);
          return navigator.hardwareConcurrency;
        },
        { src: SRC, backend, count: ELEMENTS },
      );
      expect(await page.evaluate('created')).toStrictEqual(devices);
      const active = await page.evaluate(
        "[...document.querySelectorAll('relightable-photo')].map((photo) => photo.activeBackend)",
      );
      expect(active).toStrictEqual(Array(ELEMENTS).fill(backend));
      // The decoding workers have ended.
      const relighters = page.workers().filter((worker) => worker.url().includes('relighter'));
      expect(relighters.length).toBeLessThanOrEqual(backend === 'cpu' ? Math.min(4, workers) : 0);
      const want = nativePicture('spectrum');
      expect(await capturePicture(page)).toMatchPicture(want, 1);
    });
  }
});

/** Waits until the CPU module is loaded, which replaces a lost device. @param {import('@playwright/test').Page} page */
const waitForCpuModule = (page) =>
  page.waitForFunction(() =>
    performance.getEntriesByType('resource').some(({ name }) => name.endsWith('/cpu_bg.wasm')),
  );

test.describe('offline, after loading,', () => {
  test('an element still draws, and changes its backend', async ({ openPhoto, server }) => {
    const page = await openPhoto({ src: SRC, backend: 'webgl2 cpu', light: 'flood' });
    await waitForCpuModule(page);
    await page.context().setOffline(true);
    const want = nativePicture('spectrum');
    expect(await capturePicture(page, { light: 'spectrum' })).toMatchPicture(want, 1);
    const requests = server.requestedRanges.get(SRC)?.length;
    await page.evaluate("photo.backend = 'cpu'");
    await waitForEvents(page, 'backendchange', 2);
    expect(await page.evaluate('photo.activeBackend')).toBe('cpu');
    expect(await capturePicture(page)).toMatchPicture(want, 1);
    await page.evaluate("photo.backend = 'webgl2'");
    await waitForEvents(page, 'backendchange', 3);
    expect(await capturePicture(page)).toMatchPicture(want, 1);
    expect(server.requestedRanges.get(SRC)?.length, 'the file is not requested again').toBe(
      requests,
    );
  });

  test('a lost context is replaced', async ({ openPhoto }) => {
    const page = await openPhoto(
      { src: SRC, backend: 'webgl2 cpu', light: 'spectrum' },
      {
        before: () => {
          const { getContext } = HTMLCanvasElement.prototype;
          HTMLCanvasElement.prototype.getContext = /** @type {any} */ (
            /** @this {HTMLCanvasElement} @param {string} kind @param {any[]} rest */
            function (kind, ...rest) {
              const context = Reflect.apply(getContext, this, [kind, ...rest]);
              if (kind === 'webgl2') Object.assign(globalThis, { context });
              return context;
            }
          );
        },
      },
    );
    await page.context().setOffline(true);
    await page.evaluate("context.getExtension('WEBGL_lose_context').loseContext()");
    const photoEvents = await waitForEvents(page, 'backendchange', 2);
    const change = photoEvents.findLast((event) => event.type === 'backendchange');
    expect(change?.['previous']).toBe('webgl2');
    expect(String(change?.['reason'])).toMatch(/was lost/);
    const want = nativePicture('spectrum');
    expect(await capturePicture(page)).toMatchPicture(want, 1);
    expect(photoEvents.filter((event) => event.type === 'error').length).toBe(0);
  });
});

test.describe('a file', () => {
  test('loads with two requests', async ({ openPage, server }) => {
    const page = await openPage('/plain');
    const src = `${SRC}?requests`;
    await mountPhoto(page, { src, backend: 'cpu' });
    await waitForLoad(page);
    const ranges = server.requestedRanges.get(src) ?? [];
    note(`requested ${ranges.join(', ')}`);
    expect(ranges.length).toBe(2);
    expect(ranges[0] ?? '').toMatch(/^0-\d+$/);
    expect(ranges[1] ?? '').toMatch(/^[1-9]\d*-\d+$/);
  });
});

test.describe('over a slow network', () => {
  /** @param {import('./fixtures.js').OpenPhoto} openPhoto */
  const openSlowPage = async (openPhoto) => {
    // Scripts and modules load before the network slows down.
    const page = await openPhoto({ src: `${SRC}?first`, backend: 'cpu' });
    await page.evaluate('photo.remove(), void (photoEvents.length = 0)');
    const session = await page.context().newCDPSession(page);
    const [downloadThroughput, uploadThroughput] = [SLOW_NETWORK, SLOW_NETWORK];
    const slow = { offline: false, latency: 50, downloadThroughput, uploadThroughput };
    await session.send('Network.enable');
    await session.send('Network.emulateNetworkConditions', slow);
    return page;
  };

  test('an element reports its progress many times', async ({ openPhoto }) => {
    const page = await openSlowPage(openPhoto);
    await page.evaluate(`photo.src = '${SRC}?slow', document.body.append(photo)`);
    const progress = (await waitForLoad(page)).filter((event) => event.type === 'progress');
    expect(progress.length, `${progress.length} events`).toBeGreaterThanOrEqual(4);
    expect(progress.at(-1)?.['loaded']).toBe(glassBytes().length);
  });

  test('the first picture appears before half of the file has arrived', async ({ openPhoto }) => {
    const page = await openSlowPage(openPhoto);
    await page.evaluate(`photo.src = '${SRC}?progressive', document.body.append(photo)`);
    await page.waitForFunction(() => {
      const photo = document.querySelector('relightable-photo');
      return photo?.shadowRoot?.querySelector('canvas');
    });
    const photoEvents = await page.evaluate('photoEvents');
    const came = photoEvents.findLast((/** @type {any} */ event) => event.type === 'progress');
    expect(Number(came?.loaded), `drawn after ${came?.loaded} bytes`).toBeLessThan(
      glassBytes().length / 2,
    );
  });
});
