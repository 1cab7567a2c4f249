/** Requests for a photograph: ranges, interrupted transfers, compression, caches, and the worker that decodes. */

import { expect, test } from './fixtures.js';
import { capturePicture, loadPhoto, mountPhoto, waitForLoad } from './page-helpers.js';
import { demoBytes, glassBytes, nativePicture } from './test-photos.js';
import { FIRST_BYTES } from './test-server.js';

const SRC = '/photos/glass.ltm';

/** The ranges of the two requests for a file of a size in bytes. */
const twoRanges = (/** @type {number} */ size) => [
  `0-${FIRST_BYTES - 1}`,
  `${FIRST_BYTES}-${size - 1}`,
];

/**
 * Loads a photograph from an address that no other test or step requests.
 *
 * @param {import('@playwright/test').Page} page
 * @param {import('./test-server.js').TestServer} server
 * @param {string} path
 * @param {'origin' | 'otherOrigin'} [where]
 */
async function load(page, server, path, where = 'origin') {
  await page.goto('/plain');
  const address = `${path}?for=${test.info().testId}-${where}`;
  await mountPhoto(page, { src: server[where] + address, backend: 'cpu', light: 'spectrum' });
  const photoEvents = await waitForLoad(page);
  return { photoEvents, ranges: server.requestedRanges.get(address) };
}

test.describe('a photograph', () => {
  test('is requested from every kind of server', async ({ openPage, server, step }) => {
    const page = await openPage('/blank');
    const expectSpectrum = async () =>
      expect(await capturePicture(page)).toMatchPicture(nativePicture('spectrum'), 1);

    await step('a photograph loads with two requests that do not overlap', async () => {
      const { photoEvents, ranges } = await load(page, server, '/photos/stained-glass.ltm');
      expect(ranges).toStrictEqual(twoRanges(demoBytes().length));
      const progress = photoEvents.filter((event) => event.type === 'progress');
      expect(progress.at(-1)?.['loaded']).toBe(demoBytes().length);
    });

    await step('a photograph loads with one request from a server without ranges', async () => {
      const { ranges } = await load(page, server, '/faults/slow');
      expect(ranges?.length).toBe(1);
    });

    for (const where of /** @type {const} */ (['origin', 'otherOrigin'])) {
      await step(`a photograph loads with two requests from the server's ${where}`, async () => {
        const { ranges } = await load(page, server, '/faults/shared', where);
        expect(ranges).toStrictEqual(twoRanges(glassBytes().length));
        await expectSpectrum();
      });
    }

    await step('a photograph continues an interrupted transfer where it ended', async () => {
      const { ranges } = await load(page, server, '/faults/breaking');
      expect(ranges?.slice(0, 2)).toStrictEqual(twoRanges(glassBytes().length));
      // The browser may split the rest into the part that its cache lacks and the part that the page lacks.
      const rest = ranges?.slice(2) ?? [];
      for (const range of rest)
        expect(Number.parseInt(range ?? '', 10)).toBeGreaterThan(FIRST_BYTES);
      expect(rest).not.toHaveLength(0);
      await expectSpectrum();
    });

    await step('a photograph starts again when the file is replaced on the server', async () => {
      const { ranges } = await load(page, server, '/faults/replaced-once');
      const twice = [...twoRanges(glassBytes().length), ...twoRanges(glassBytes().length)];
      expect(ranges).toStrictEqual(twice);
      await expectSpectrum();
    });

    await step(
      'a photograph is requested as a whole when the server compresses its ranges',
      async () => {
        const { ranges } = await load(page, server, '/faults/compressed-parts');
        expect(ranges?.at(-1)).toBeUndefined();
        await expectSpectrum();
      },
    );

    await step('a photograph is read from the browser’s cache', async () => {
      const { ranges } = await load(page, server, '/faults/cached');
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
  test('is decoded on the main thread when the worker fails', async ({ openPage, step }) => {
    const page = await openPage('/blank');
    for (const [what, worker] of WORKERS) {
      await step(`a photograph is decoded on the main thread when the worker ${what}`, async () => {
        await page.unrouteAll();
        await page.route('**/relightable-photo-worker.js', (route) =>
          typeof worker === 'number'
            ? route.fulfill({ status: worker })
            : route.fulfill({ contentType: 'text/javascript', body: worker }),
        );
        await loadPhoto(page, { src: SRC, backend: 'cpu', light: 'spectrum' });
        expect(await capturePicture(page)).toMatchPicture(nativePicture('spectrum'), 1);
      });
    }
  });

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
