/** The workers that relight on the CPU: how many, for how long, and what becomes of photographs without them. */

import assert from 'node:assert/strict';
import { describe, test } from 'node:test';
import { compare } from '../../www/tools/pictures.js';
import { happenedUntil, loaded, mount, openPage, picture, until, withoutGpus } from './browser.js';
import { nativePicture, TALL as TALL_FILE, TALL_ROWS } from './photos.js';

const GLASS = { src: '/photos/glass.ltm', backend: 'cpu', light: 'spectrum' };
const TALL = { ...GLASS, src: '/photos/tall.ltm' };
const SCRIPT = '/relightable-photo-relighter.js';

/** @param {import('playwright-core').Page} page */
const crewOf = (page) => page.workers().filter((worker) => worker.url().endsWith(SCRIPT));

/** @param {import('playwright-core').Page} page */
async function drawsRight(page) {
  assert.ok(compare(await picture(page), nativePicture('spectrum', 'reference')).worst <= 1);
}

/** Waits until the browser has ended all workers. @param {import('playwright-core').Page} page */
const gone = (page) => until(() => crewOf(page).length === 0, 'the workers to end');

/** What a worker takes for a fault of its own, and stops. */
const POISON = "{ number: 0, photo: -1, task: { kind: 'plan' } }";

/** Keeps the workers that a page starts; where `spoilt` is true, they stop at their next frame. */
const keepingWorkers = () => {
  const kept = /** @type {Worker[]} */ ([]);
  const { Worker } = globalThis;
  globalThis.Worker = class extends Worker {
    /** @param {string | URL} url @param {WorkerOptions} [options] */
    constructor(url, options) {
      super(url, options);
      if (String(url).endsWith('/relightable-photo-relighter.js')) kept.push(this);
    }

    /** @override @param {any} message @param {any} transfer */
    postMessage(message, transfer) {
      const { spoilt } = /** @type {any} */ (globalThis);
      if (spoilt && message.task?.kind === 'relight') {
        super.postMessage({ number: 0, photo: -1, task: { kind: 'plan' } });
      }
      super.postMessage(message, transfer);
    }
  };
  Object.assign(globalThis, { kept, spoilt: false });
};

/** What workers run first: notes the memory of their modules, which have no other way to it. */
const NOTING = `
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

/** Has workers note their memory. @param {import('playwright-core').Page} page */
function noteMemory(page) {
  return page.route(`**${SCRIPT}`, async (route) => {
    const response = await route.fetch();
    await route.fulfill({ response, body: NOTING + (await response.text()) });
  });
}

/**
 * Bytes of the CPU modules' memory, of the page's and of each worker's, which note theirs.
 *
 * @param {import('playwright-core').Page} page
 * @returns {Promise<number[]>}
 */
function memory(page) {
  const own = async () => {
    const module = '/relightable-photo/wasm/cpu.js';
    return (await (await import(module)).default()).memory.buffer.byteLength;
  };
  const noted = 'memories.reduce((sum, { buffer }) => sum + buffer.byteLength, 0)';
  return Promise.all([
    page.evaluate(own),
    ...crewOf(page).map((worker) => worker.evaluate(noted).then(Number)),
  ]);
}

/**
 * Puts more photographs into a page, and waits for them.
 *
 * @param {import('playwright-core').Page} page
 * @param {number} count
 * @param {string} src
 */
async function mountMore(page, count, src) {
  await page.evaluate(
    async ({ count, src }) => {
      const loads = Array.from({ length: count }, () => {
        const photo = document.createElement('relightable-photo');
        Object.assign(photo, { src, backend: 'cpu', light: 'spectrum', loading: 'eager' });
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
 * Encoded pictures of all photographs of a page, which are to be the same.
 *
 * @param {import('playwright-core').Page} page
 * @returns {Promise<Set<string>>}
 */
async function pictures(page) {
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
 * @param {import('playwright-core').Page} page
 */
function allDrawn(page) {
  return page.evaluate(async () => {
    const photos = [...document.querySelectorAll('relightable-photo')];
    for (;;) {
      const blobs = await Promise.allSettled(photos.map((photo) => photo.toBlob()));
      if (blobs.every(({ status }) => status === 'fulfilled')) return;
      await new Promise((resolve) => setTimeout(resolve, 50));
    }
  });
}

/**
 * What draws each photograph of a page.
 *
 * @param {import('playwright-core').Page} page
 * @returns {Promise<string[]>}
 */
function kernels(page) {
  return page.evaluate(
    "[...document.querySelectorAll('relightable-photo')].map(({ kernel }) => kernel)",
  );
}

describe('workers that relight', () => {
  test('are as many as there are cores, four at most, and end with the last photograph', async (t) => {
    const page = await openPage(t, '/bench');
    await mount(page, TALL);
    await loaded(page);
    const native = nativePicture('spectrum', 'reference', 1, undefined, TALL_FILE);
    assert.ok(compare(await picture(page), native).worst <= 1);
    const cores = Number(await page.evaluate('navigator.hardwareConcurrency'));
    await mountMore(page, 7, TALL.src);
    assert.equal((await pictures(page)).size, 1);
    const crew = crewOf(page);
    assert.equal(crew.length, Math.min(4, cores, TALL_ROWS));
    const ends = crew.map((worker) => worker.waitForEvent('close'));
    await page.evaluate(() => {
      const photos = [...document.querySelectorAll('relightable-photo')];
      for (const photo of photos.slice(1)) photo.remove();
    });
    await picture(page, { light: 'stripes' });
    assert.equal(crewOf(page).length, crew.length);
    await page.evaluate("document.querySelector('relightable-photo').remove()");
    await Promise.all(ends);
  });

  for (const [what, status] of /** @type {const} */ ([
    ['missing', 404],
    ['no script', 200],
  ])) {
    test(`are done without where their script is ${what}`, async (t) => {
      const page = await openPage(t, '/bench');
      await page.route(`**${SCRIPT}`, (route) =>
        route.fulfill({ status, contentType: 'text/javascript', body: 'this is no JavaScript' }),
      );
      await mount(page, GLASS);
      await loaded(page);
      assert.equal(await page.evaluate('photo.kernel'), 'simd128');
      await gone(page);
      await drawsRight(page);
    });
  }

  test('are done without where a policy refuses them', async (t) => {
    const page = await openPage(t, '/blank', { refusal: /worker/i });
    await page.route('**/bench', async (route) => {
      const response = await route.fetch();
      const headers = { 'content-security-policy': "worker-src 'none'" };
      await route.fulfill({ response, headers: { ...response.headers(), ...headers } });
    });
    await page.goto('/bench');
    await mount(page, GLASS);
    await loaded(page);
    assert.equal(await page.evaluate('photo.kernel'), 'simd128');
    await drawsRight(page);
  });

  for (const [how, stop] of /** @type {const} */ ([
    ['by itself', `kept.at(-1).postMessage(${POISON})`],
    ['without a word', 'kept.at(-1).terminate()'],
  ])) {
    test(`one of which stops ${how} in the middle have the photograph fetched anew`, async (t) => {
      const page = await openPage(t, '/bench', { before: keepingWorkers });
      await mount(page, TALL);
      await loaded(page);
      const before = await picture(page);
      await page.evaluate(stop);
      // One is on its way there, the other waits for that.
      const asked = page.evaluate(
        `Promise.all([photo.toBlob(), photo.toBlob()]).catch((error) => error.code)`,
      );
      const happened = await happenedUntil(page, 'backendchange', 2);
      assert.equal(await asked, 'photo-lost');
      const change = happened.findLast((event) => event.type === 'backendchange');
      assert.equal(change?.['backend'], 'cpu');
      assert.equal(change?.['previous'], 'cpu');
      assert.match(String(change?.['reason']), /worker stopped\..* went with it\./);
      await happenedUntil(page, 'load', 2);
      assert.ok(!happened.some((event) => event.type === 'error'));
      assert.equal(compare(before, await picture(page)).worst, 0);
    });
  }

  test('one of which stops are an error where the photograph is gone from the server', async (t) => {
    const page = await openPage(t, '/bench', { before: keepingWorkers });
    await mount(page, GLASS);
    await loaded(page);
    await page.route('**/glass.ltm', (route) => route.fulfill({ status: 404 }));
    await page.evaluate(`kept[0].postMessage(${POISON})`);
    await page.evaluate('photo.exposure = 2');
    const error = (await happenedUntil(page, 'error')).find((event) => event.type === 'error');
    assert.equal(error?.['code'], 'http-status');
    // The picture there was is whole, and stays.
    assert.equal(await page.locator('relightable-photo canvas').count(), 1);
  });

  test('that stop now and then are replaced, and other photographs too are right', async (t) => {
    const page = await openPage(t, '/bench', { before: keepingWorkers });
    await mount(page, GLASS);
    await loaded(page);
    await mountMore(page, 3, GLASS.src);
    const before = Number(await page.evaluate('kept.length'));
    for (let times = 1; times <= 4; times += 1) {
      await page.evaluate(`kept.at(-1).postMessage(${POISON})`);
      await allDrawn(page);
      assert.equal((await pictures(page)).size, 1);
      assert.equal(await page.evaluate('kept.length'), before + times);
    }
    await drawsRight(page);
    assert.ok((await kernels(page)).every((kernel) => kernel.includes('worker')));
    assert.equal(await page.evaluate("happened.some(({ type }) => type === 'error')"), false);
  });

  test('that stop before they have drawn, again and again, are done without', async (t) => {
    const page = await openPage(t, '/bench', { before: keepingWorkers });
    await mount(page, GLASS);
    await loaded(page);
    await mountMore(page, 3, GLASS.src);
    await page.evaluate('spoilt = true');
    await allDrawn(page);
    assert.equal((await pictures(page)).size, 1);
    await drawsRight(page);
    assert.deepEqual(new Set(await kernels(page)), new Set(['simd128']));
    await gone(page);
    assert.equal(await page.evaluate("happened.some(({ type }) => type === 'error')"), false);
  });

  for (const [where, backend, before] of /** @type {const} */ ([
    ['', 'cpu', undefined],
    [', also where graphics devices are asked for that are not there', undefined, withoutGpus],
  ])) {
    test(`have the only copy of its tiles${where}`, async (t) => {
      const page = await openPage(t, '/bench', before ? { before } : {});
      await noteMemory(page);
      await mount(page, { src: TALL.src, light: TALL.light, ...(backend && { backend }) });
      await loaded(page);
      assert.equal(await page.evaluate('photo.activeBackend'), 'cpu');
      const decoded = Number(await page.evaluate('photo.info.decodedBytes'));
      const [own = 0, ...crew] = await memory(page);
      const all = crew.reduce((sum, bytes) => sum + bytes, own);
      t.diagnostic(
        `${decoded} bytes decoded, ${own} in the page, ${crew.join(' and ')} in workers`,
      );
      // What a module takes without any photograph, and to work with.
      const work = 3 << 20;
      // Each worker had one tile on its way, and memory does not shrink. A second copy of all tiles
      // takes more than what is left of `work`.
      const moving = (crew.length * decoded) / TALL_ROWS;
      assert.ok(own < work, `${own} in the page`);
      assert.ok(all < decoded + moving + (1 + crew.length) * work, `${own} + ${crew}`);
    });
  }

  test('need no more memory for two thousand frames than for one', async (t) => {
    const page = await openPage(t, '/bench');
    await noteMemory(page);
    const session = await page.context().newCDPSession(page);
    const buffers = async () => {
      await session.send('HeapProfiler.collectGarbage');
      const usage = /** @type {any} */ (await session.send('Runtime.getHeapUsage'));
      return Number(usage.backingStorageSize ?? 0);
    };
    await mount(page, { ...GLASS, light: 'torch' });
    await loaded(page);
    const frames = (/** @type {number} */ count) =>
      page.evaluate(async (count) => {
        const { photo } = /** @type {any} */ (globalThis);
        for (let i = 0; i < count; i += 1) {
          photo.torch = { x: (i % 100) / 100, y: 0.5 };
          await photo.toBlob({ type: 'image/jpeg' });
        }
      }, count);
    await frames(50);
    const before = { modules: await memory(page), buffers: await buffers() };
    await frames(2000);
    const after = { modules: await memory(page), buffers: await buffers() };
    t.diagnostic(JSON.stringify({ before, after }));
    assert.deepEqual(after.modules, before.modules);
    // Two thousand pictures of 64 by 64 pixels would be 32 MB.
    assert.ok(after.buffers < before.buffers + (1 << 20), JSON.stringify({ before, after }));
  });

  test('and tiles that change places again and again need no more memory', async (t) => {
    const page = await openPage(t, '/bench');
    await noteMemory(page);
    await mount(page, GLASS);
    await loaded(page);
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
      await gone(page);
      await change('cpu');
      return memory(page);
    };
    await round();
    const before = await round();
    for (let i = 0; i < 5; i += 1) await round();
    assert.deepEqual(await round(), before);
    await drawsRight(page);
  });
});
