/** The pool of relighting workers: its size, its life, workers that stop, and its memory. */

import { expect, note, test } from './fixtures.js';
import {
  capturePicture,
  loadPhoto,
  mountPhoto,
  removeGraphics,
  waitForEvents,
  waitForLoad,
  waitForWarning,
} from './page-helpers.js';
import { nativePicture, TALL_FILE, TALL_TILE_ROWS } from './test-photos.js';

const GLASS = { src: '/photos/glass.ltm', backend: 'cpu', light: 'spectrum' };
const TALL = { ...GLASS, src: '/photos/tall.ltm' };
const SCRIPT = '/relightable-photo-relighter.js';

/** @param {import('@playwright/test').Page} page */
const poolOf = (page) => page.workers().filter((worker) => worker.url().endsWith(SCRIPT));

/** @param {import('@playwright/test').Page} page */
async function expectSpectrum(page) {
  expect(await capturePicture(page)).toMatchPicture(nativePicture('spectrum'), 1);
}

/** Waits until the browser has ended all workers. @param {import('@playwright/test').Page} page */
const waitForPoolEnd = (page) => expect.poll(() => poolOf(page).length).toBe(0);

/** Longer than the element waits for a silent worker. */
const SILENCE_MS = 25_000;

/** A message that no client sends: the worker fails. */
const INVALID_MESSAGE = "{ id: 0, task: { photo: -1, task: { kind: 'plan' } } }";

/**
 * For `before` of `openPage`: `relighters` has the page's relighting workers. While `failing` is true, each worker
 * fails at its next frame.
 */
const recordWorkers = () => {
  const relighters = /** @type {Worker[]} */ ([]);
  const { Worker } = globalThis;
  globalThis.Worker = class extends Worker {
    /** @param {string | URL} url @param {WorkerOptions} [options] */
    constructor(url, options) {
      super(url, options);
      if (String(url).endsWith('/relightable-photo-relighter.js')) relighters.push(this);
    }

    /** @override @param {any} message @param {any} transfer */
    postMessage(message, transfer) {
      const { failing } = /** @type {any} */ (globalThis);
      if (failing && message?.task?.task?.kind === 'relight') {
        super.postMessage({ id: 0, task: { photo: -1, task: { kind: 'plan' } } });
      }
      super.postMessage(message, transfer);
    }
  };
  Object.assign(globalThis, { relighters, failing: false });
};

/** Runs in a worker before its script: records the memory of its WebAssembly instances. */
const RECORD_MEMORY = `
  const memories = (globalThis.memories = []);
  for (const name of ['instantiate', 'instantiateStreaming']) {
    const make = WebAssembly[name];
    WebAssembly[name] = async (...given) => {
      const made = await make.apply(WebAssembly, given);
      memories.push((made.instance ?? made).exports.memory);
      return made;
    };
  }
`;

/** Makes workers record their memory. @param {import('@playwright/test').Page} page */
function recordMemory(page) {
  return page.route(`**${SCRIPT}`, async (route) => {
    const response = await route.fetch();
    await route.fulfill({ response, body: RECORD_MEMORY + (await response.text()) });
  });
}

/**
 * Bytes of the CPU module's memory: first the main thread's, then each worker's.
 *
 * @param {import('@playwright/test').Page} page
 * @returns {Promise<number[]>}
 */
function memorySizes(page) {
  const own = async () => {
    const module = '/relightable-photo/wasm/cpu.js';
    return (await (await import(module)).default()).memory.buffer.byteLength;
  };
  const sum = 'memories.reduce((sum, { buffer }) => sum + buffer.byteLength, 0)';
  return Promise.all([
    page.evaluate(own),
    ...poolOf(page).map((worker) => worker.evaluate(sum).then(Number)),
  ]);
}

/**
 * Puts more photographs into a page, each with an address of its own, and waits until they have loaded.
 *
 * @param {import('@playwright/test').Page} page
 * @param {number} count
 * @param {string} src
 */
async function mountMore(page, count, src) {
  await page.evaluate(
    async ({ count, src }) => {
      const loads = Array.from({ length: count }, (_, i) => {
        const photo = document.createElement('relightable-photo');
        Object.assign(photo, {
          src: `${src}?${i}`,
          backend: 'cpu',
          light: 'spectrum',
          loading: 'eager',
        });
        const load = new Promise((resolve, reject) => {
          photo.addEventListener('load', resolve);
          photo.addEventListener('error', (event) => reject(new Error(event.message)));
        });
        document.body.append(photo);
        return load;
      });
      await Promise.all(loads);
    },
    { count, src },
  );
}

/**
 * The different encoded pictures of all photographs of a page.
 *
 * @param {import('@playwright/test').Page} page
 * @returns {Promise<Set<string>>}
 */
async function distinctPictures(page) {
  const all = await page.evaluate(async () => {
    const photos = [...document.querySelectorAll('relightable-photo')];
    const texts = photos.map(async (photo) => {
      const bytes = new Uint8Array(await (await photo.toBlob()).arrayBuffer());
      return bytes.join();
    });
    return await Promise.all(texts);
  });
  return new Set(all);
}

/**
 * Waits until all photographs of a page can be drawn; those that lost parts cannot for a while.
 *
 * @param {import('@playwright/test').Page} page
 */
function waitUntilDrawable(page) {
  const rejected = () =>
    page.evaluate(async () => {
      const photos = [...document.querySelectorAll('relightable-photo')];
      const blobs = await Promise.allSettled(photos.map((photo) => photo.toBlob()));
      return blobs.filter(({ status }) => status === 'rejected').length;
    });
  return expect.poll(rejected).toBe(0);
}

/**
 * The kernel of each photograph of a page.
 *
 * @param {import('@playwright/test').Page} page
 * @returns {Promise<string[]>}
 */
function kernels(page) {
  return page.evaluate(
    "[...document.querySelectorAll('relightable-photo')].map(({ kernel }) => kernel)",
  );
}

test.describe('the worker pool', () => {
  test('has a worker for each core, four at most, and ends with the last photograph', async ({
    openPhoto,
  }) => {
    const page = await openPhoto(TALL);
    const native = nativePicture('spectrum', { photo: TALL_FILE });
    expect(await capturePicture(page)).toMatchPicture(native, 1);
    const cores = Number(await page.evaluate('navigator.hardwareConcurrency'));
    await mountMore(page, 7, TALL.src);
    expect((await distinctPictures(page)).size).toBe(1);
    const pool = poolOf(page);
    expect(pool.length).toBe(Math.min(4, cores, TALL_TILE_ROWS));
    const ends = pool.map((worker) => worker.waitForEvent('close'));
    await page.evaluate(() => {
      const photos = [...document.querySelectorAll('relightable-photo')];
      for (const photo of photos.slice(1)) photo.remove();
    });
    await capturePicture(page, { light: 'stripes' });
    expect(poolOf(page).length).toBe(pool.length);
    await page.evaluate("document.querySelector('relightable-photo').remove()");
    await Promise.all(ends);
  });

  for (const [what, status] of /** @type {const} */ ([
    ['is missing', 404],
    ['is not JavaScript', 200],
  ])) {
    test(`is replaced by the main thread when its script ${what}`, async ({ openPage }) => {
      const page = await openPage('/plain');
      await page.route(`**${SCRIPT}`, (route) =>
        route.fulfill({ status, contentType: 'text/javascript', body: 'this is no JavaScript' }),
      );
      await mountPhoto(page, GLASS);
      await waitForLoad(page);
      expect(await page.evaluate('photo.kernel')).toBe('simd128');
      await waitForPoolEnd(page);
      await expectSpectrum(page);
    });
  }

  test('is replaced by the main thread when a policy refuses workers', async ({ openPage }) => {
    const page = await openPage('/blank', { expectedMessages: /worker/i });
    await page.route('**/plain', async (route) => {
      const response = await route.fetch();
      const headers = { 'content-security-policy': "worker-src 'none'" };
      await route.fulfill({ response, headers: { ...response.headers(), ...headers } });
    });
    await loadPhoto(page, GLASS);
    expect(await page.evaluate('photo.kernel')).toBe('simd128');
    await expectSpectrum(page);
  });

  for (const [how, stop] of /** @type {const} */ ([
    ['by an error', `relighters.at(-1).postMessage(${INVALID_MESSAGE})`],
    ['silently', 'relighters.at(-1).terminate()'],
  ])) {
    test(`loads the photograph again when a worker stops ${how}`, async ({ openPhoto }) => {
      const page = await openPhoto(TALL, { before: recordWorkers, fakeClock: true });
      const before = await capturePicture(page);
      await page.evaluate(stop);
      // The first call is sent to the worker, the second waits for the first.
      const results = page.evaluate(
        `Promise.all([photo.toBlob(), photo.toBlob()]).catch((error) => error.code)`,
      );
      // A silent worker counts as dead after twenty seconds.
      await page.clock.runFor(SILENCE_MS);
      const photoEvents = await waitForEvents(page, 'backendchange', 2);
      expect(await results).toBe('photo-lost');
      const change = photoEvents.findLast((event) => event.type === 'backendchange');
      expect(change?.['backend']).toBe('cpu');
      expect(change?.['previous']).toBe('cpu');
      expect(String(change?.['reason'])).toMatch(/worker stopped\..* went with it\./);
      await waitForEvents(page, 'load', 2);
      expect(photoEvents.some((event) => event.type === 'error')).toBeFalsy();
      expect(before).toMatchPicture(await capturePicture(page), 0);
    });
  }

  test('warns when a worker stops and the photograph is gone from the server', async ({
    openPhoto,
  }) => {
    const page = await openPhoto(GLASS, { before: recordWorkers });
    await page.route('**/glass.ltm', (route) => route.fulfill({ status: 404 }));
    await page.evaluate(`relighters[0].postMessage(${INVALID_MESSAGE})`);
    await page.evaluate('photo.exposure = 2');
    expect((await waitForWarning(page))['code']).toBe('http-status');
    // The last picture stays.
    expect(await page.locator('relightable-photo canvas').count()).toBe(1);
  });

  test('replaces workers that stop, and all photographs stay correct', async ({ openPhoto }) => {
    const page = await openPhoto(GLASS, { before: recordWorkers });
    await mountMore(page, 3, GLASS.src);
    const before = Number(await page.evaluate('relighters.length'));
    for (let times = 1; times <= 4; times += 1) {
      await page.evaluate(`relighters.at(-1).postMessage(${INVALID_MESSAGE})`);
      await waitUntilDrawable(page);
      expect((await distinctPictures(page)).size).toBe(1);
      expect(await page.evaluate('relighters.length')).toBe(before + times);
    }
    await expectSpectrum(page);
    for (const kernel of await kernels(page)) expect(kernel).toContain('worker');
    expect(await page.evaluate("photoEvents.some(({ type }) => type === 'error')")).toBe(false);
  });

  test('is replaced by the main thread when workers stop repeatedly before they draw', async ({
    openPhoto,
  }) => {
    const page = await openPhoto(GLASS, { before: recordWorkers });
    await mountMore(page, 3, GLASS.src);
    await page.evaluate('failing = true');
    await waitUntilDrawable(page);
    expect((await distinctPictures(page)).size).toBe(1);
    await expectSpectrum(page);
    expect(new Set(await kernels(page))).toStrictEqual(new Set(['simd128']));
    await waitForPoolEnd(page);
    expect(await page.evaluate("photoEvents.some(({ type }) => type === 'error')")).toBe(false);
  });

  for (const [where, backend, before] of /** @type {const} */ ([
    ['', 'cpu', undefined],
    [', also when graphics backends are listed first', undefined, removeGraphics],
  ])) {
    test(`holds the only copy of the tiles${where}`, async ({ openPage }) => {
      const page = await openPage('/plain', before ? { before } : {});
      await recordMemory(page);
      await mountPhoto(page, { src: TALL.src, light: TALL.light, ...(backend && { backend }) });
      await waitForLoad(page);
      expect(await page.evaluate('photo.activeBackend')).toBe('cpu');
      const decoded = Number(await page.evaluate('photo.info.decodedBytes'));
      const [main = 0, ...workers] = await memorySizes(page);
      const all = workers.reduce((sum, bytes) => sum + bytes, main);
      note(
        `${decoded} bytes decoded, ${main} on the main thread, ${workers.join(' and ')} in workers`,
      );
      // A module without a photograph, and its scratch memory.
      const overhead = 3 << 20;
      // Each worker received one tile at a time, and memory does not shrink. A second copy of all tiles is larger
      // than what `overhead` leaves.
      const transferred = (workers.length * decoded) / TALL_TILE_ROWS;
      expect(main, `${main} on the main thread`).toBeLessThan(overhead);
      expect(all, `${main} + ${workers}`).toBeLessThan(
        decoded + transferred + (1 + workers.length) * overhead,
      );
    });
  }

  test('does not grow over two thousand frames', async ({ openPage }) => {
    test.slow();
    const page = await openPage('/plain');
    await recordMemory(page);
    const session = await page.context().newCDPSession(page);
    const buffers = async () => {
      await session.send('HeapProfiler.collectGarbage');
      const usage = /** @type {any} */ (await session.send('Runtime.getHeapUsage'));
      return Number(usage.backingStorageSize ?? 0);
    };
    await mountPhoto(page, { ...GLASS, light: 'torch' });
    await waitForLoad(page);
    const frames = (/** @type {number} */ count) =>
      page.evaluate(async (count) => {
        const { photo } = /** @type {any} */ (globalThis);
        for (let i = 0; i < count; i += 1) {
          photo.torch = { x: (i % 100) / 100, y: 0.5 };
          // Chromium encodes WebP at once, and PNG and JPEG only when the page is idle.
          await photo.toBlob({ type: 'image/webp' });
        }
      }, count);
    await frames(50);
    const before = { modules: await memorySizes(page), buffers: await buffers() };
    await frames(2000);
    const after = { modules: await memorySizes(page), buffers: await buffers() };
    note(JSON.stringify({ before, after }));
    expect(after.modules).toStrictEqual(before.modules);
    // Two thousand pictures of 64 by 64 pixels would be 32 MB.
    expect(after.buffers, JSON.stringify({ before, after })).toBeLessThan(
      before.buffers + (1 << 20),
    );
  });

  test('does not grow when the backend changes repeatedly', async ({ openPage }) => {
    const page = await openPage('/plain');
    await recordMemory(page);
    await mountPhoto(page, GLASS);
    await waitForLoad(page);
    const change = (/** @type {string} */ backend) =>
      page.evaluate(async (backend) => {
        const { photo } = /** @type {any} */ (globalThis);
        const changed = new Promise((resolve) =>
          photo.addEventListener('backendchange', resolve, { once: true }),
        );
        photo.backend = backend;
        await changed;
      }, backend);
    const round = async () => {
      await change('webgl2');
      await waitForPoolEnd(page);
      await change('cpu');
      return memorySizes(page);
    };
    await round();
    const before = await round();
    for (let i = 0; i < 5; i += 1) await round();
    expect(await round()).toStrictEqual(before);
    await expectSpectrum(page);
  });
});
