/** Elements that are added, changed and removed at any time: progress, cancelled transfers, memory. */

import { expect, note, test } from './fixtures.js';
import {
  capturePicture,
  loadPhoto,
  mountPhoto,
  waitForEvents,
  waitForFrames,
  waitForLoad,
} from './page-helpers.js';
import { glassBytes, nativePicture } from './test-photos.js';

/** @param {import('./page-helpers.js').ElementEvent[]} photoEvents @param {string} type */
const count = (photoEvents, type) => photoEvents.filter((event) => event.type === type).length;

test.describe('the module', () => {
  test('can be imported without a DOM, as on a server', async () => {
    // The type checker does not follow a variable into the bundle.
    const bundle = '../../dist/relightable-photo.js';
    const module = await import(bundle);
    expect(module.TAG).toBe('relightable-photo');
  });
});

test.describe('an element', () => {
  test('reports its progress up to the size of the file', async ({ openPage }) => {
    const page = await openPage('/plain');
    await mountPhoto(page, { src: '/faults/slow', backend: 'cpu' });
    await waitForEvents(page, 'progress');
    await page.getByRole('progressbar', { name: 'Loading the picture' }).waitFor();
    const progress = (await waitForLoad(page)).filter((event) => event.type === 'progress');
    expect(progress.length, `${progress.length} events`).toBeGreaterThan(2);
    const sizes = progress.map((event) => Number(event['loaded']));
    expect(sizes).toStrictEqual([...sizes].sort((a, b) => a - b));
    expect(sizes.at(-1)).toBe(glassBytes().length);
    expect(progress.every((event) => event['total'] === glassBytes().length)).toBeTruthy();
    await page.getByRole('progressbar').waitFor({ state: 'hidden' });
  });

  test('accepts a compressed transfer', async ({ openPage, server, step }) => {
    const page = await openPage('/blank');
    for (const where of /** @type {const} */ (['origin', 'otherOrigin'])) {
      for (const path of ['/faults/gzipped', '/faults/gzipped-longer']) {
        await step(
          `an element accepts a compressed transfer from the server's ${where}: ${path}`,
          async () => {
            const photoEvents = await loadPhoto(page, {
              src: server[where] + path,
              backend: 'cpu',
            });
            const progress = photoEvents.filter((event) => event.type === 'progress');
            const { loaded: bytes, total } = /** @type {any} */ (progress.at(-1));
            expect({ bytes, total }).toStrictEqual({
              bytes: glassBytes().length,
              total: glassBytes().length,
            });
            expect(
              progress.every((event) => Number(event['loaded']) <= Number(event['total'])),
            ).toBeTruthy();
          },
        );
      }
    }
  });

  test('cancels a transfer when src changes', async ({ openPage, server }) => {
    const page = await openPage('/plain');
    server.abortedPaths.length = 0;
    await mountPhoto(page, { src: '/faults/slow', backend: 'cpu', light: 'spectrum' });
    await waitForEvents(page, 'progress');
    await page.evaluate("photo.src = '/photos/glass.ltm'");
    const photoEvents = await waitForLoad(page);
    expect(count(photoEvents, 'load')).toBe(1);
    await expect.poll(() => server.abortedPaths).toContain('/faults/slow');
    expect(await capturePicture(page)).toMatchPicture(nativePicture('spectrum'), 1);
  });

  test('that is removed cancels its transfer without an error, and loads when it is added again', async ({
    openPage,
    server,
  }) => {
    const page = await openPage('/plain');
    server.abortedPaths.length = 0;
    await mountPhoto(page, { src: '/faults/slow', backend: 'cpu' });
    await waitForEvents(page, 'progress');
    await page.evaluate('photo.remove()');
    await expect.poll(() => server.abortedPaths).toContain('/faults/slow');
    expect(count(await page.evaluate('photoEvents'), 'error')).toBe(0);
    await page.evaluate("photo.src = '/photos/glass.ltm', document.body.append(photo)");
    await waitForLoad(page);
  });

  test('that moves within the page does not load again', async ({ openPhoto }) => {
    const page = await openPhoto({ src: '/photos/glass.ltm', backend: 'cpu' });
    await page.evaluate("document.body.append(document.createElement('hr'), photo)");
    await capturePicture(page, { light: 'stripes' });
    expect(count(await page.evaluate('photoEvents'), 'load')).toBe(1);
  });

  for (const backend of ['webgpu', 'webgl2', 'cpu']) {
    test(`that is removed releases its memory on ${backend}`, async ({ openPhoto }) => {
      test.slow();
      const page = await openPhoto({ src: '/photos/glass.ltm', backend });
      const growth = await page.evaluate(async (backend) => {
        const { photo } = /** @type {any} */ (globalThis);
        const module = `/relightable-photo/wasm/${backend}.js`;
        const { memory } = await (await import(module)).default();
        const bytes = () => memory.buffer.byteLength;
        // Five at a time: most of the time goes into the graphics device, which is made for the first of them.
        const photos = [photo, ...Array.from({ length: 4 }, () => photo.cloneNode())];
        const again = async () => {
          for (const one of photos) one.remove();
          await new Promise((resolve) => setTimeout(resolve));
          const loads = photos.map(
            (one) =>
              new Promise((resolve) => one.addEventListener('load', resolve, { once: true })),
          );
          document.body.append(...photos);
          await Promise.all(loads);
        };
        await again();
        let before = 0;
        // Fragmentation makes a heap grow once in a while, a leak makes it grow in every round.
        for (let round = 0; round < 3; round += 1) {
          before = bytes();
          for (let i = 0; i < 2; i += 1) await again();
          if (bytes() === before) break;
        }
        return { before, after: bytes(), photo: photo.info.decodedBytes };
      }, backend);
      note(JSON.stringify(growth));
      // Ten loads may fragment the heap, but not by the size of a photograph.
      expect(growth.after - growth.before, JSON.stringify(growth)).toBeLessThan(growth.photo);
    });
  }

  test('that is added and removed 200 times leaves no nodes, listeners, workers or memory', async ({
    openPage,
  }) => {
    test.slow();
    const page = await openPage('/plain');
    const session = await page.context().newCDPSession(page);
    const usage = async () => {
      // Until the timers of the last elements have fired, and idle workers have ended.
      await page.waitForTimeout(1500);
      // Finalizers run after a collection, and a later collection frees what they release.
      for (let i = 0; i < 3; i += 1) {
        await session.send('HeapProfiler.collectGarbage');
        await waitForFrames(page, 6);
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
    const AT_ONCE = 4;
    const cycle = (/** @type {number} */ elements) =>
      page.evaluate(
        async ([rounds, atOnce]) => {
          for (let round = 0; round < rounds; round += 1) {
            const photos = Array.from({ length: atOnce }, () => {
              const photo = document.createElement('relightable-photo');
              return Object.assign(photo, {
                src: '/photos/glass.ltm',
                backend: 'cpu',
                loading: 'eager',
              });
            });
            const loads = photos.map(
              (photo) =>
                new Promise((resolve, reject) => {
                  photo.addEventListener('load', resolve);
                  photo.addEventListener('error', ({ message }) => reject(new Error(message)));
                }),
            );
            document.body.append(...photos);
            await Promise.all(loads);
            for (const photo of photos) photo.remove();
            await new Promise((resolve) => setTimeout(resolve));
          }
        },
        /** @type {const} */ ([elements / AT_ONCE, AT_ONCE]),
      );
    // Enough for the memory of the modules to reach its peak.
    await cycle(100);
    let before = await usage();
    await cycle(200);
    let after = await usage();
    // How loads overlap may raise the peak once more; memory that leaks grows in every round.
    for (let round = 1; round < 3 && after.wasm > before.wasm; round += 1) {
      before = after;
      await cycle(200);
      after = await usage();
    }
    note(`${JSON.stringify(before)} → ${JSON.stringify(after)}`);
    expect(after.wasm).toBe(before.wasm);
    expect(after.workers).toBe(before.workers);
    expect(after.nodes - before.nodes, 'nodes').toBeLessThan(200);
    expect(after.listeners - before.listeners, 'listeners').toBeLessThan(200);
    // Compiled code takes some of it once; each element that leaks takes ten kilobytes.
    expect(after.heap - before.heap, 'the heap of scripts').toBeLessThan(200 * 2500);
  });

  test('that loads repeatedly does not take the WebGL2 context of another element', async ({
    openPhoto,
  }) => {
    const page = await openPhoto({
      src: '/photos/glass.ltm',
      backend: 'webgl2 cpu',
      light: 'spectrum',
    });
    // Chromium allows sixteen WebGL contexts for a page, and a further one takes the oldest.
    const backends = await page.evaluate(async () => {
      const other = document.createElement('relightable-photo');
      Object.assign(other, { src: '/photos/glass.ltm', backend: 'webgl2 cpu', loading: 'eager' });
      document.body.append(other);
      let changes = 0;
      other.addEventListener('backendchange', () => {
        changes += 1;
      });
      const used = [];
      for (let i = 0; i < 20; i += 1) {
        await new Promise((resolve) => other.addEventListener('load', resolve, { once: true }));
        used.push(other.activeBackend);
        if (i < 19) other.setAttribute('src', '/photos/glass.ltm');
      }
      // The browser reports a lost context in a task of its own.
      for (let i = 0; i < 6; i += 1) await new Promise(requestAnimationFrame);
      return [changes, ...used, /** @type {any} */ (globalThis).photo.activeBackend];
    });
    expect(backends).toStrictEqual([20, ...Array(21).fill('webgl2')]);
    const photoEvents = await page.evaluate('photoEvents');
    expect(count(photoEvents, 'backendchange')).toBe(1);
    expect(count(photoEvents, 'error')).toBe(0);
    expect(await capturePicture(page)).toMatchPicture(nativePicture('spectrum'), 1);
  });

  test('applies properties that were set before it was defined', async ({ openPage }) => {
    const page = await openPage('/blank');
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
      return [early.light, early.activeLight];
    });
    expect(light).toStrictEqual(['stripes', 'stripes']);
  });

  test('is not affected by another that is removed', async ({ openPhoto }) => {
    const page = await openPhoto({ src: '/photos/glass.ltm', light: 'spectrum' });
    await page.evaluate(async () => {
      const other = document.createElement('relightable-photo');
      Object.assign(other, { src: '/photos/glass.ltm', light: 'flood', loading: 'eager' });
      document.body.append(other);
      await new Promise((resolve) => other.addEventListener('load', resolve));
      other.remove();
    });
    expect(await capturePicture(page)).toMatchPicture(nativePicture('spectrum'), 1);
  });

  test('is an image with a name, and decoration with an empty alt', async ({ openPhoto }) => {
    const page = await openPhoto({ src: '/photos/glass.ltm', alt: 'A window', backend: 'cpu' });
    await page.getByRole('img', { name: 'A window' }).waitFor();
    await page.evaluate("photo.alt = ''");
    await page.waitForFunction(() =>
      document.querySelector('relightable-photo')?.shadowRoot?.querySelector('[role=presentation]'),
    );
    // A slider takes the keyboard, so the element is not decoration.
    await page.evaluate("photo.light = 'torch'");
    await page.getByRole('slider').waitFor();
    expect(await page.getByRole('img').count()).toBe(0);
    await page.evaluate("photo.light = 'flood'");
    await page.getByRole('slider').waitFor({ state: 'hidden' });
  });
});
