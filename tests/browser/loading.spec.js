/** Requests for a photograph: ranges, interrupted transfers, compression, caches, and the worker that decodes. */

import { expect, test } from './fixtures.js';
import { capturePicture, mountPhoto, waitForLoad } from './page-helpers.js';
import { demoBytes, glassBytes, nativePicture } from './test-photos.js';
import { FIRST_BYTES } from './test-server.js';

const SRC = '/photos/glass.ltm';

/** The ranges of the two requests for a file of a size in bytes. */
const twoRanges = (/** @type {number} */ size) => [
  `0-${FIRST_BYTES - 1}`,
  `${FIRST_BYTES}-${size - 1}`,
];

/**
 * Loads a photograph from an address that no other test requests.
 *
 * @param {{ openPage: import('./fixtures.js').OpenPage, server: import('./test-server.js').TestServer }} fixtures
 * @param {string} path
 * @param {string} [origin] the page's by default
 */
async function load({ openPage, server }, path, origin = server.origin) {
  const page = await openPage('/plain');
  const address = `${path}?for=${test.info().testId}`;
  await mountPhoto(page, { src: origin + address, backend: 'cpu', light: 'spectrum' });
  const photoEvents = await waitForLoad(page);
  return { page, photoEvents, ranges: server.requestedRanges.get(address) };
}

test.describe('a photograph', () => {
  test('loads with two requests that do not overlap', async ({ openPage, server }) => {
    const { photoEvents, ranges } = await load({ openPage, server }, '/photos/stained-glass.ltm');
    expect(ranges).toStrictEqual(twoRanges(demoBytes().length));
    const progress = photoEvents.filter((event) => event.type === 'progress');
    expect(progress.at(-1)?.['loaded']).toBe(demoBytes().length);
  });

  test('loads with one request from a server without ranges', async ({ openPage, server }) => {
    const { ranges } = await load({ openPage, server }, '/faults/slow');
    expect(ranges?.length).toBe(1);
  });

  for (const where of /** @type {const} */ (['origin', 'otherOrigin'])) {
    test(`loads with two requests from the server's ${where}`, async ({ openPage, server }) => {
      const { page, ranges } = await load({ openPage, server }, '/faults/shared', server[where]);
      expect(ranges).toStrictEqual(twoRanges(glassBytes().length));
      expect(await capturePicture(page)).toMatchPicture(nativePicture('spectrum'), 1);
    });
  }

  test('continues an interrupted transfer where it ended', async ({ openPage, server }) => {
    const { page, ranges } = await load({ openPage, server }, '/faults/breaking');
    expect(ranges?.slice(0, 2)).toStrictEqual(twoRanges(glassBytes().length));
    // The browser may split the rest into the part that its cache lacks and the part that the page lacks.
    const rest = ranges?.slice(2) ?? [];
    for (const range of rest) expect(Number.parseInt(range ?? '', 10)).toBeGreaterThan(FIRST_BYTES);
    expect(rest).not.toHaveLength(0);
    expect(await capturePicture(page)).toMatchPicture(nativePicture('spectrum'), 1);
  });

  test('starts again when the file is replaced on the server', async ({ openPage, server }) => {
    const { page, ranges } = await load({ openPage, server }, '/faults/replaced-once');
    const twice = [...twoRanges(glassBytes().length), ...twoRanges(glassBytes().length)];
    expect(ranges).toStrictEqual(twice);
    expect(await capturePicture(page)).toMatchPicture(nativePicture('spectrum'), 1);
  });

  test('is requested as a whole when the server compresses its ranges', async ({
    openPage,
    server,
  }) => {
    const { page, ranges } = await load({ openPage, server }, '/faults/compressed-parts');
    expect(ranges?.at(-1)).toBeUndefined();
    expect(await capturePicture(page)).toMatchPicture(nativePicture('spectrum'), 1);
  });

  test('is read from the browser’s cache', async ({ openPage, server }) => {
    const { page, ranges } = await load({ openPage, server }, '/faults/cached');
    expect(ranges).toStrictEqual(twoRanges(glassBytes().length));
    await page.evaluate(async () => {
      const { photo } = /** @type {any} */ (globalThis);
      const load = new Promise((resolve) =>
        photo.addEventListener('load', resolve, { once: true }),
      );
      photo.setAttribute('src', photo.getAttribute('src'));
      await load;
    });
    expect(ranges?.length).toBe(2);
  });

  test('is decoded by a worker, which then ends', async ({ openPage }) => {
    const page = await openPage('/plain');
    /** @type {Promise<unknown>[]} */
    const ends = [];
    page.on('worker', (worker) => {
      if (worker.url().endsWith('/relightable-photo-worker.js')) {
        ends.push(worker.waitForEvent('close'));
      }
    });
    await mountPhoto(page, { src: SRC, backend: 'cpu', light: 'spectrum' });
    await waitForLoad(page);
    expect(ends.length).toBe(1);
    await Promise.all(ends);
    expect(await capturePicture(page)).toMatchPicture(nativePicture('spectrum'), 1);
  });

  /** @type {[what: string, worker: string | number][]} */
  const WORKERS = [
    ['is missing', 404],
    ['is not JavaScript', 'this is no JavaScript'],
    ['does not understand the request', 'onmessage = () => {}; postMessage({ kind: "failed" });'],
  ];
  for (const [what, worker] of WORKERS) {
    test(`is decoded on the main thread when the worker ${what}`, async ({ openPage }) => {
      const page = await openPage('/plain');
      await page.route('**/relightable-photo-worker.js', (route) =>
        typeof worker === 'number'
          ? route.fulfill({ status: worker })
          : route.fulfill({ contentType: 'text/javascript', body: worker }),
      );
      await mountPhoto(page, { src: SRC, backend: 'cpu', light: 'spectrum' });
      await waitForLoad(page);
      expect(await capturePicture(page)).toMatchPicture(nativePicture('spectrum'), 1);
    });
  }

  test('is decoded on the main thread when the browser refuses workers', async ({ openPhoto }) => {
    const page = await openPhoto(
      { src: SRC, backend: 'cpu', light: 'spectrum' },
      {
        before: () => {
          globalThis.Worker = /** @type {any} */ (
            class {
              constructor() {
                throw new DOMException('of another origin', 'SecurityError');
              }
            }
          );
        },
      },
    );
    expect(await capturePicture(page)).toMatchPicture(nativePicture('spectrum'), 1);
  });
});
