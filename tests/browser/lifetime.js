/** Elements come, change and go at any time. */

import assert from 'node:assert/strict';
import { describe, test } from 'node:test';
import { compare } from '../../www/tools/pictures.js';
import {
  aborted,
  happenedUntil,
  loaded,
  mount,
  openPage,
  origin,
  otherOrigin,
  picture,
  until,
} from './browser.js';
import { glassBytes, nativePicture } from './photos.js';

/** @param {import('./browser.js').Happening[]} happened @param {string} type */
const count = (happened, type) => happened.filter((event) => event.type === type).length;

describe('the module', () => {
  test('can be imported where there are no elements, as on a server', async () => {
    // By a name the type checker does not follow into the bundle.
    const bundle = '../../dist/relightable-photo.js';
    const module = await import(bundle);
    assert.equal(module.TAG, 'relightable-photo');
  });
});

describe('an element', () => {
  test('tells its progress up to the whole file', async (t) => {
    const page = await openPage(t, '/bench');
    await mount(page, { src: '/faults/slow', backend: 'cpu' });
    await happenedUntil(page, 'progress');
    await page.getByRole('progressbar', { name: 'Loading the picture' }).waitFor();
    const progress = (await loaded(page)).filter((event) => event.type === 'progress');
    assert.ok(progress.length > 2, `${progress.length} events`);
    const sizes = progress.map((event) => Number(event['loaded']));
    assert.deepEqual(
      sizes,
      [...sizes].sort((a, b) => a - b),
    );
    assert.equal(sizes.at(-1), glassBytes.length);
    assert.ok(progress.every((event) => event['total'] === glassBytes.length));
    await page.getByRole('progressbar').waitFor({ state: 'hidden' });
  });

  for (const from of [origin, otherOrigin]) {
    for (const path of ['/faults/gzipped', '/faults/gzipped-longer']) {
      const where = from === origin ? 'its own origin' : 'another origin';
      test(`takes a compressed transfer from ${where}: ${path}`, async (t) => {
        const page = await openPage(t, '/bench');
        await mount(page, { src: from + path, backend: 'cpu' });
        const progress = (await loaded(page)).filter((event) => event.type === 'progress');
        const { loaded: bytes, total } = /** @type {any} */ (progress.at(-1));
        assert.deepEqual({ bytes, total }, { bytes: glassBytes.length, total: glassBytes.length });
        assert.ok(progress.every((event) => Number(event['loaded']) <= Number(event['total'])));
      });
    }
  }

  test('given another src in the middle of a load drops the first', async (t) => {
    const page = await openPage(t, '/bench');
    aborted.length = 0;
    await mount(page, { src: '/faults/slow', backend: 'cpu', light: 'spectrum' });
    await happenedUntil(page, 'progress');
    await page.evaluate("photo.src = '/photos/glass.ltm'");
    const happened = await loaded(page);
    assert.equal(count(happened, 'load'), 1);
    await until(() => aborted.includes('/faults/slow'), 'the transfer to be ended');
    assert.ok(compare(await picture(page), nativePicture('spectrum', 'reference')).worst <= 1);
  });

  test('removed in the middle of a load ends the transfer, says nothing, and comes back', async (t) => {
    const page = await openPage(t, '/bench');
    aborted.length = 0;
    await mount(page, { src: '/faults/slow', backend: 'cpu' });
    await happenedUntil(page, 'progress');
    await page.evaluate('photo.remove()');
    await until(() => aborted.includes('/faults/slow'), 'the transfer to be ended');
    assert.equal(count(await page.evaluate('happened'), 'error'), 0);
    await page.evaluate("photo.src = '/photos/glass.ltm', document.body.append(photo)");
    await loaded(page);
  });

  test('moved within the page is not loaded again', async (t) => {
    const page = await openPage(t, '/bench');
    await mount(page, { src: '/photos/glass.ltm', backend: 'cpu' });
    await loaded(page);
    await page.evaluate("document.body.append(document.createElement('hr'), photo)");
    await picture(page, { light: 'stripes' });
    assert.equal(count(await page.evaluate('happened'), 'load'), 1);
  });

  for (const backend of ['webgpu', 'webgl2', 'cpu']) {
    test(`leaves no memory behind on ${backend}`, async (t) => {
      const page = await openPage(t, '/bench');
      await mount(page, { src: '/photos/glass.ltm', backend });
      await loaded(page);
      const growth = await page.evaluate(async (backend) => {
        const { photo } = /** @type {any} */ (globalThis);
        const module = `/relightable-photo/wasm/${backend}.js`;
        const { memory } = await (await import(module)).default();
        const bytes = () => memory.buffer.byteLength;
        const again = async () => {
          photo.remove();
          await new Promise((resolve) => setTimeout(resolve));
          const load = new Promise((resolve) =>
            photo.addEventListener('load', resolve, { once: true }),
          );
          document.body.append(photo);
          await load;
        };
        await again();
        let before = 0;
        // Now and then a heap grows by what does not fit its gaps; by what leaks it grows always.
        for (let round = 0; round < 3; round += 1) {
          before = bytes();
          for (let i = 0; i < 10; i += 1) await again();
          if (bytes() === before) break;
        }
        return { before, after: bytes(), photo: photo.info.decodedBytes };
      }, backend);
      // Ten loads may cost what an allocator wastes, but not one photograph.
      assert.ok(growth.after - growth.before < growth.photo, JSON.stringify(growth));
    });
  }

  test('that comes and goes 200 times leaves nothing behind', async (t) => {
    const page = await openPage(t, '/bench');
    const session = await page.context().newCDPSession(page);
    const held = async () => {
      // What the first collection finds is let go by the next.
      for (let i = 0; i < 3; i += 1) {
        await session.send('HeapProfiler.collectGarbage');
        await page.waitForTimeout(100);
      }
      const { usedSize } = await session.send('Runtime.getHeapUsage');
      const { nodes, jsEventListeners: listeners } = await session.send('Memory.getDOMCounters');
      const wasm = Number(
        await page.evaluate(async () => {
          const modules = ['decoder', 'cpu'].map((name) => `/relightable-photo/wasm/${name}.js`);
          const started = performance.getEntriesByType('resource').map(({ name }) => name);
          let sum = 0;
          for (const module of modules) {
            if (!started.some((name) => name.endsWith(module))) continue;
            sum += (await (await import(module)).default()).memory.buffer.byteLength;
          }
          return sum;
        }),
      );
      return { heap: usedSize, nodes, listeners, wasm, workers: page.workers().length };
    };
    const cycle = (/** @type {number} */ times) =>
      page.evaluate(async (times) => {
        for (let i = 0; i < times; i += 1) {
          const photo = document.createElement('relightable-photo');
          Object.assign(photo, { src: '/photos/glass.ltm', backend: 'cpu', loading: 'eager' });
          const load = new Promise((resolve, reject) => {
            photo.addEventListener('load', resolve);
            photo.addEventListener('error', ({ message }) => reject(new Error(message)));
          });
          document.body.append(photo);
          await load;
          photo.remove();
          await new Promise((resolve) => setTimeout(resolve));
        }
      }, times);
    await cycle(20);
    const before = await held();
    await cycle(200);
    const after = await held();
    t.diagnostic(`${JSON.stringify(before)} → ${JSON.stringify(after)}`);
    assert.equal(after.wasm, before.wasm);
    assert.equal(after.workers, before.workers);
    assert.ok(after.nodes - before.nodes < 200, 'nodes');
    assert.ok(after.listeners - before.listeners < 200, 'listeners');
    // What is compiled meanwhile takes some, once; an element that stays takes ten kilobytes.
    assert.ok(after.heap - before.heap < 200 * 2500, 'the heap of scripts');
  });

  test('loaded again and again leaves the graphics of others alone', async (t) => {
    const page = await openPage(t, '/bench');
    await mount(page, { src: '/photos/glass.ltm', backend: 'webgl2 cpu', light: 'spectrum' });
    await loaded(page);
    // Chromium has sixteen WebGL contexts for a page, and takes away the oldest for a new one.
    const backends = await page.evaluate(async () => {
      const other = document.createElement('relightable-photo');
      Object.assign(other, { src: '/photos/glass.ltm', backend: 'webgl2 cpu', loading: 'eager' });
      document.body.append(other);
      const used = [];
      for (let i = 0; i < 20; i += 1) {
        await new Promise((resolve) => other.addEventListener('load', resolve, { once: true }));
        used.push(other.activeBackend);
        if (i < 19) other.setAttribute('src', '/photos/glass.ltm');
      }
      // The browser tells of a context taken away in a task of its own.
      await new Promise((resolve) => setTimeout(resolve, 100));
      return [...used, /** @type {any} */ (globalThis).photo.activeBackend];
    });
    assert.deepEqual(backends, Array(21).fill('webgl2'));
    const happened = await page.evaluate('happened');
    assert.equal(count(happened, 'backendchange'), 21);
    assert.equal(count(happened, 'error'), 0);
    assert.ok(compare(await picture(page), nativePicture('spectrum', 'reference')).worst <= 1);
  });

  test('with properties set before it was defined takes them up', async (t) => {
    const page = await openPage(t, '/blank');
    const light = await page.evaluate(async () => {
      const early = Object.assign(document.createElement('relightable-photo'), {
        src: '/photos/glass.ltm',
        loading: 'eager',
        light: 'stripes',
        backend: 'cpu',
      });
      document.body.append(early);
      const load = new Promise((resolve, reject) => {
        early.addEventListener('load', resolve);
        early.addEventListener('error', (event) => reject(new Error(event.message)));
      });
      const script = '/relightable-photo/relightable-photo.js';
      await import(script);
      await load;
      return early.getAttribute('light');
    });
    assert.equal(light, 'stripes');
  });

  test('two of them on a page do not disturb each other', async (t) => {
    const page = await openPage(t, '/bench');
    await mount(page, { src: '/photos/glass.ltm', light: 'spectrum' });
    await loaded(page);
    await page.evaluate(async () => {
      const other = document.createElement('relightable-photo');
      Object.assign(other, { src: '/photos/glass.ltm', light: 'flood', loading: 'eager' });
      document.body.append(other);
      await new Promise((resolve) => other.addEventListener('load', resolve));
      other.remove();
    });
    assert.ok(compare(await picture(page), nativePicture('spectrum', 'reference')).worst <= 1);
  });

  test('without alternative text is still an image, with an empty one decoration', async (t) => {
    const page = await openPage(t, '/bench');
    await mount(page, { src: '/photos/glass.ltm', alt: 'A window', backend: 'cpu' });
    await loaded(page);
    await page.getByRole('img', { name: 'A window' }).waitFor();
    await page.evaluate("photo.alt = ''");
    await page.waitForFunction(() =>
      document.querySelector('relightable-photo')?.shadowRoot?.querySelector('[role=presentation]'),
    );
    // What takes the keyboard is no decoration, but a part of its own.
    await page.evaluate("photo.light = 'torch'");
    await page.getByRole('slider').waitFor();
    assert.equal(await page.getByRole('img').count(), 0);
    await page.evaluate("photo.light = 'flood'");
    await page.getByRole('slider').waitFor({ state: 'hidden' });
  });
});
