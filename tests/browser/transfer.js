/** How photographs come: in which parts, from which servers. */

import assert from 'node:assert/strict';
import { describe, test } from 'node:test';
import { compare } from '../../www/tools/pictures.js';
import {
  asked,
  FIRST_BYTES,
  loaded,
  mount,
  openPage,
  origin,
  otherOrigin,
  picture,
} from './browser.js';
import { demoBytes, glassBytes, nativePicture } from './photos.js';

const SRC = '/photos/glass.ltm';

/** The ranges of two requests that bring a file of so many bytes. */
const inTwo = (/** @type {number} */ size) => [
  `0-${FIRST_BYTES - 1}`,
  `${FIRST_BYTES}-${size - 1}`,
];

/**
 * Opens a photograph from an address that no other test has asked for.
 *
 * @param {import('node:test').TestContext} t
 * @param {string} path
 * @param {string} [from]
 */
async function opened(t, path, from = origin) {
  const page = await openPage(t, '/bench');
  const address = `${path}?for=${encodeURIComponent(t.name)}`;
  await mount(page, { src: from + address, backend: 'cpu', light: 'spectrum' });
  const happened = await loaded(page);
  return { page, happened, ranges: asked.get(address) };
}

describe('a photograph', () => {
  test('comes with two requests, of which no byte is for nothing', async (t) => {
    const { happened, ranges } = await opened(t, '/photos/stained-glass.ltm');
    assert.deepEqual(ranges, inTwo(demoBytes.length));
    const progress = happened.filter((event) => event.type === 'progress');
    assert.equal(progress.at(-1)?.['loaded'], demoBytes.length);
  });

  test('comes with one from a server that knows no ranges', async (t) => {
    const { ranges } = await opened(t, '/faults/slow');
    assert.equal(ranges?.length, 1);
  });

  for (const from of [origin, otherOrigin]) {
    const where = from === origin ? 'its own origin' : 'another origin';
    test(`comes in parts from ${where}`, async (t) => {
      const { page, ranges } = await opened(t, '/faults/shared', from);
      assert.deepEqual(ranges, inTwo(glassBytes.length));
      assert.ok(compare(await picture(page), nativePicture('spectrum', 'reference')).worst <= 1);
    });
  }

  test('whose transfer breaks off goes on where it ended', async (t) => {
    const { page, ranges } = await opened(t, '/faults/breaking');
    assert.deepEqual(ranges?.slice(0, 2), inTwo(glassBytes.length));
    // The browser may ask for what its cache lacks and what the page lacks by themselves.
    assert.ok(ranges?.slice(2).every((range) => Number.parseInt(range ?? '', 10) > FIRST_BYTES));
    assert.ok(compare(await picture(page), nativePicture('spectrum', 'reference')).worst <= 1);
  });

  test('that is replaced meanwhile is begun anew', async (t) => {
    const { page, ranges } = await opened(t, '/faults/replaced-once');
    const twice = [...inTwo(glassBytes.length), ...inTwo(glassBytes.length)];
    assert.deepEqual(ranges, twice);
    assert.ok(compare(await picture(page), nativePicture('spectrum', 'reference')).worst <= 1);
  });

  test('that a server compresses, part by part, comes whole', async (t) => {
    const { page, ranges } = await opened(t, '/faults/compressed-parts');
    assert.equal(ranges?.at(-1), undefined);
    assert.ok(compare(await picture(page), nativePicture('spectrum', 'reference')).worst <= 1);
  });

  test('is not fetched again while the browser has it', async (t) => {
    const { page, ranges } = await opened(t, '/faults/cached');
    assert.deepEqual(ranges, inTwo(glassBytes.length));
    await page.evaluate(async () => {
      const { photo } = /** @type {any} */ (globalThis);
      const load = new Promise((resolve) =>
        photo.addEventListener('load', resolve, { once: true }),
      );
      photo.setAttribute('src', photo.getAttribute('src'));
      await load;
    });
    assert.equal(ranges?.length, 2);
  });

  test('is decoded by a worker, which ends with it', async (t) => {
    const page = await openPage(t, '/bench');
    /** @type {Promise<unknown>[]} */
    const ends = [];
    page.on('worker', (worker) => {
      if (worker.url().endsWith('/relightable-photo-worker.js')) {
        ends.push(worker.waitForEvent('close'));
      }
    });
    await mount(page, { src: SRC, backend: 'cpu', light: 'spectrum' });
    await loaded(page);
    assert.equal(ends.length, 1);
    await Promise.all(ends);
    assert.ok(compare(await picture(page), nativePicture('spectrum', 'reference')).worst <= 1);
  });

  /** @type {[what: string, worker: string | number][]} */
  const WORKERS = [
    ['is not there', 404],
    ['is no script', 'this is no JavaScript'],
    ['does not know what is asked', 'onmessage = () => {}; postMessage({ kind: "failed" });'],
  ];
  for (const [what, worker] of WORKERS) {
    test(`is decoded on the page where the worker ${what}`, async (t) => {
      const page = await openPage(t, '/bench');
      await page.route('**/relightable-photo-worker.js', (route) =>
        typeof worker === 'number'
          ? route.fulfill({ status: worker })
          : route.fulfill({ contentType: 'text/javascript', body: worker }),
      );
      await mount(page, { src: SRC, backend: 'cpu', light: 'spectrum' });
      await loaded(page);
      assert.ok(compare(await picture(page), nativePicture('spectrum', 'reference')).worst <= 1);
    });
  }

  test('is decoded on the page where workers are refused', async (t) => {
    const page = await openPage(t, '/bench', {
      before: () => {
        globalThis.Worker = /** @type {any} */ (
          class {
            constructor() {
              throw new DOMException('of another origin', 'SecurityError');
            }
          }
        );
      },
    });
    await mount(page, { src: SRC, backend: 'cpu', light: 'spectrum' });
    await loaded(page);
    assert.ok(compare(await picture(page), nativePicture('spectrum', 'reference')).worst <= 1);
  });
});
