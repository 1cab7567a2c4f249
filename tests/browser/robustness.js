/** Many elements, no network and a slow one. */

import assert from 'node:assert/strict';
import { describe, test } from 'node:test';
import { compare } from '../../www/tools/pictures.js';
import { asked, happenedUntil, loaded, mount, openPage, picture } from './browser.js';
import { glassBytes, nativePicture } from './photos.js';

const SRC = '/photos/glass.ltm';
const ELEMENTS = 16;
/** 1 Mbit/s, in bytes a second. */
const SLOW = 1e6 / 8;

/** For pages to run first: counts the graphics devices and contexts that are made. */
const counting = () => {
  const made = { devices: 0, contexts: 0 };
  Object.assign(globalThis, { made });
  const adapter = /** @type {any} */ (globalThis).GPUAdapter.prototype;
  const { requestDevice } = adapter;
  adapter.requestDevice = /** @this {any} @param {any[]} args */ function (...args) {
    made.devices += 1;
    return Reflect.apply(requestDevice, this, args);
  };
  const { getContext } = HTMLCanvasElement.prototype;
  HTMLCanvasElement.prototype.getContext = /** @type {any} */ (
    /** @this {HTMLCanvasElement} @param {string} kind @param {any[]} rest */
    function (kind, ...rest) {
      if (kind === 'webgl2') made.contexts += 1;
      return Reflect.apply(getContext, this, [kind, ...rest]);
    }
  );
};

describe('sixteen elements', () => {
  for (const [backend, devices] of /** @type {const} */ ([
    ['webgpu', { devices: 1, contexts: 0 }],
    // And one that only tells what devices are called.
    ['webgl2', { devices: 0, contexts: 2 }],
    ['cpu', { devices: 0, contexts: 0 }],
  ])) {
    test(`share what they draw with on ${backend}`, async (t) => {
      const page = await openPage(t, '/bench', { before: counting });
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
      assert.deepEqual(await page.evaluate('made'), devices);
      const active = await page.evaluate(
        "[...document.querySelectorAll('relightable-photo')].map((photo) => photo.activeBackend)",
      );
      assert.deepEqual(active, Array(ELEMENTS).fill(backend));
      // Decoders have gone; those that relight are as many as there are cores, four at most.
      const relighters = page.workers().filter((worker) => worker.url().includes('relighter'));
      assert.ok(relighters.length <= (backend === 'cpu' ? Math.min(4, workers) : 0));
      const want = nativePicture('spectrum', 'reference');
      assert.ok(compare(await picture(page), want).worst <= 1);
    });
  }
});

/** Waits for the module that takes a device's place. @param {import('playwright-core').Page} page */
const spare = (page) =>
  page.waitForFunction(() =>
    performance.getEntriesByType('resource').some(({ name }) => name.endsWith('/cpu_bg.wasm')),
  );

describe('without a network, once loaded,', () => {
  test('an element goes on, on other back ends too', async (t) => {
    const page = await openPage(t, '/bench');
    await mount(page, { src: SRC, backend: 'webgl2 cpu', light: 'flood' });
    await loaded(page);
    await spare(page);
    await page.context().setOffline(true);
    const want = nativePicture('spectrum', 'reference');
    assert.ok(compare(await picture(page, { light: 'spectrum' }), want).worst <= 1);
    const requests = asked.get(SRC)?.length;
    await page.evaluate("photo.backend = 'cpu'");
    await happenedUntil(page, 'backendchange', 2);
    assert.equal(await page.evaluate('photo.activeBackend'), 'cpu');
    assert.ok(compare(await picture(page), want).worst <= 1);
    await page.evaluate("photo.backend = 'webgl2'");
    await happenedUntil(page, 'backendchange', 3);
    assert.ok(compare(await picture(page), want).worst <= 1);
    assert.equal(asked.get(SRC)?.length, requests, 'the file was asked for again');
  });

  test('a context that is lost is made anew', async (t) => {
    const page = await openPage(t, '/bench', {
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
    });
    await mount(page, { src: SRC, backend: 'webgl2 cpu', light: 'spectrum' });
    await loaded(page);
    await page.context().setOffline(true);
    await page.evaluate("context.getExtension('WEBGL_lose_context').loseContext()");
    const happened = await happenedUntil(page, 'backendchange', 2);
    const change = happened.findLast((event) => event.type === 'backendchange');
    assert.equal(change?.['previous'], 'webgl2');
    assert.match(String(change?.['reason']), /was lost/);
    const want = nativePicture('spectrum', 'reference');
    assert.ok(compare(await picture(page), want).worst <= 1);
    assert.equal(happened.filter((event) => event.type === 'error').length, 0);
  });
});

describe('a file', () => {
  test('is opened by two requests', async (t) => {
    const page = await openPage(t, '/bench');
    const src = `${SRC}?requests`;
    await mount(page, { src, backend: 'cpu' });
    await loaded(page);
    const ranges = asked.get(src) ?? [];
    t.diagnostic(`asked for ${ranges.join(', ')}`);
    assert.equal(ranges.length, 2);
    assert.match(ranges[0] ?? '', /^0-\d+$/);
    assert.match(ranges[1] ?? '', /^[1-9]\d*-\d+$/);
  });
});

describe('over a slow network', () => {
  /** @param {import('node:test').TestContext} t */
  const slowPage = async (t) => {
    const page = await openPage(t, '/bench');
    await page.evaluate("customElements.whenDefined('relightable-photo').then(() => {})");
    // What every page has once: measured is the photograph.
    await mount(page, { src: `${SRC}?first`, backend: 'cpu' });
    await loaded(page);
    await page.evaluate('photo.remove(), void (happened.length = 0)');
    const session = await page.context().newCDPSession(page);
    const [downloadThroughput, uploadThroughput] = [SLOW, SLOW];
    const slow = { offline: false, latency: 50, downloadThroughput, uploadThroughput };
    await session.send('Network.enable');
    await session.send('Network.emulateNetworkConditions', slow);
    return page;
  };

  test('an element tells its progress many times', async (t) => {
    const page = await slowPage(t);
    await page.evaluate(`photo.src = '${SRC}?slow', document.body.append(photo)`);
    const progress = (await loaded(page)).filter((event) => event.type === 'progress');
    assert.ok(progress.length >= 4, `${progress.length} events`);
    assert.equal(progress.at(-1)?.['loaded'], glassBytes.length);
  });

  test('the first picture is there before half of the file', async (t) => {
    const page = await slowPage(t);
    await page.evaluate(`photo.src = '${SRC}?progressive', document.body.append(photo)`);
    await page.waitForFunction(() => {
      const photo = document.querySelector('relightable-photo');
      return photo?.shadowRoot?.querySelector('canvas');
    });
    const happened = await page.evaluate('happened');
    const came = happened.findLast((/** @type {any} */ event) => event.type === 'progress');
    assert.ok(Number(came?.loaded) < glassBytes.length / 2, `drawn after ${came?.loaded} bytes`);
  });
});
