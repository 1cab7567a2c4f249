/** Many elements on one page: they share photographs, load one after another, and rest when memory is scarce. */

import { decodePng } from '../../www/tools/pictures.js';
import { expect, test } from './fixtures.js';
import { waitForFrames } from './page-helpers.js';
import { nativePicture } from './test-photos.js';

/** @typedef {import('@playwright/test').Page} Page */

const GLASS = '/photos/glass.ltm';

/**
 * For `before` of `openPage`: `decoders` has the living decoding workers and `decoded` counts photographs; `events` has
 * the `load` and `error` events of all elements.
 */
const watchPage = () => {
  const seen = {
    decoders: new Set(),
    maxDecoders: 0,
    decoded: 0,
    events: /** @type {any[]} */ ([]),
  };
  Object.assign(globalThis, { seen });
  const { Worker } = globalThis;
  globalThis.Worker = class extends Worker {
    /** @param {string | URL} url @param {WorkerOptions} [options] */
    constructor(url, options) {
      super(url, options);
      if (String(url).endsWith('/relightable-photo-worker.js')) seen.decoders.add(this);
      seen.maxDecoders = Math.max(seen.maxDecoders, seen.decoders.size);
    }

    /** @override @param {any} message @param {any} transfer */
    postMessage(message, transfer) {
      if (message?.task?.kind === 'finish') seen.decoded += 1;
      super.postMessage(message, transfer);
    }

    /** @override */
    terminate() {
      seen.decoders.delete(this);
      super.terminate();
    }
  };
  for (const type of ['load', 'error']) {
    document.addEventListener(
      type,
      (event) => {
        const { id, localName } = /** @type {Element} */ (event.target);
        if (localName === 'relightable-photo') {
          seen.events.push({ type, id, message: /** @type {any} */ (event).message });
        }
      },
      true,
    );
  }
};

/** As `watchPage`, on a device whose memory is too small for a photograph. */
const watchSmallDevice = () => {
  Object.defineProperty(Navigator.prototype, 'deviceMemory', { get: () => 1e-9 });
};

/**
 * Puts an element for each address into a page, one below the other, and waits until all have loaded or one fails.
 *
 * @param {Page} page
 * @param {string[]} addresses
 * @param {number} side in CSS pixels
 */
async function mountAll(page, addresses, side) {
  await page.evaluate(
    ({ addresses, side }) => {
      const photos = addresses.map((src, i) => {
        const photo = document.createElement('relightable-photo');
        photo.id = String(i);
        const attributes = { src, backend: 'cpu', light: 'spectrum', loading: 'eager' };
        for (const [name, value] of Object.entries(attributes)) {
          photo.setAttribute(name, value);
        }
        photo.style.cssText = `display: block; width: ${side}px; height: ${side}px`;
        return photo;
      });
      document.body.append(...photos);
    },
    { addresses, side },
  );
  await page.waitForFunction(
    (count) => {
      const { events } = /** @type {any} */ (globalThis).seen;
      const failed = events.find((/** @type {any} */ { type }) => type === 'error');
      if (failed) throw new Error(failed.message);
      return new Set(events.map((/** @type {any} */ { id }) => id)).size === count;
    },
    addresses.length,
    { timeout: 100_000 },
  );
}

/** The pictures of all elements, in full quality. @param {Page} page */
async function pictures(page) {
  const urls = await page.evaluate(async () => {
    const photos = /** @type {any[]} */ ([...document.querySelectorAll('relightable-photo')]);
    return await Promise.all(
      photos.map(async (photo) => {
        const bytes = new Uint8Array(await (await photo.toBlob()).arrayBuffer());
        return btoa(String.fromCharCode(...bytes));
      }),
    );
  });
  return urls.map((url) => decodePng(Buffer.from(url, 'base64')));
}

/** @param {Page} page @returns {Promise<any>} */
const seenBy = (page) =>
  page.evaluate(() => {
    const { seen } = /** @type {any} */ (globalThis);
    return { ...seen, decoders: seen.decoders.size };
  });

test.describe('many photographs', () => {
  test('elements with one address share its photograph, and each has its own light', async ({
    openPage,
    server,
  }) => {
    const page = await openPage('/plain', { before: watchPage });
    const src = `${GLASS}?shared`;
    await mountAll(page, Array(6).fill(src), 64);
    expect((await seenBy(page)).decoded).toBe(1);
    // The first part, and the rest.
    expect(server.requestedRanges.get(src)?.length).toBeLessThanOrEqual(2);
    await page.evaluate("document.getElementById('3').light = 'stripes'");
    const [spectrum, stripes] = [nativePicture('spectrum'), nativePicture('stripes')];
    for (const [i, picture] of (await pictures(page)).entries()) {
      expect(picture).toMatchPicture(i === 3 ? stripes : spectrum, 1);
    }
    expect((await seenBy(page)).decoded).toBe(1);
  });

  test('24 photographs are decoded one after another, the nearest first, and all are drawn', async ({
    openPage,
  }) => {
    const page = await openPage('/plain', { before: watchPage });
    const addresses = Array.from({ length: 24 }, (_, i) => `${GLASS}?${i}`);
    // Elements before number 12 are above the viewport.
    const side = 400;
    await page.evaluate(`
      document.body.style.paddingBottom = '20000px';
      new MutationObserver(() => scrollTo(0, ${12 * side})).observe(document.body, { childList: true });
    `);
    await mountAll(page, addresses, side);
    const { decoded, maxDecoders, events } = await seenBy(page);
    expect(decoded).toBe(24);
    expect(events.length).toBe(24);
    // A transfer that pauses lets another one start.
    expect(maxDecoders).toBeLessThanOrEqual(3);
    const first = events.slice(0, 3).map((/** @type {any} */ { id }) => Number(id));
    for (const id of first) expect(Math.abs(id - 12.5), `${first}`).toBeLessThan(3);
    for (const picture of await pictures(page)) {
      expect(picture).toMatchPicture(nativePicture('spectrum'), 1);
    }
  });

  test('on a small device, photographs out of view rest with their picture, and return', async ({
    openPage,
    server,
  }) => {
    const page = await openPage('/plain', { before: watchPage });
    await page.addInitScript(watchSmallDevice);
    await page.goto('/plain');
    const addresses = Array.from({ length: 6 }, (_, i) => `${GLASS}?resting${i}`);
    await mountAll(page, addresses, 1500);
    const fetched = () => server.requestedRanges.get(addresses[0] ?? '')?.length ?? 0;
    const before = fetched();
    await page.evaluate('scrollTo(0, document.body.scrollHeight)');
    // The browser reports that the element has left the viewport.
    await waitForFrames(page, 5);
    /** What a page can read of a resting element. */
    const about = () =>
      page.evaluate(() => {
        const photo = /** @type {any} */ (document.getElementById('0'));
        const { activeBackend, kernel, info } = photo;
        const canvas = photo.shadowRoot.querySelector('canvas');
        const { data } = canvas.getContext('2d').getImageData(0, 0, 64, 64);
        const sum = data.reduce(
          (/** @type {number} */ sum, /** @type {number} */ value) => sum + value,
          0,
        );
        return { activeBackend, width: info.width, hasKernel: Boolean(kernel), sum };
      });
    const picture = await about();
    expect(picture).toMatchObject({ activeBackend: 'cpu', width: 64, hasKernel: true });
    // A changed light is drawn when the element is in view again, for which it is fetched again.
    await page.evaluate("document.getElementById('0').light = 'stripes'");
    await page.waitForTimeout(500);
    expect(await about()).toStrictEqual(picture);
    expect(fetched()).toBe(before);
    await page.evaluate('scrollTo(0, 0)');
    await expect.poll(about).not.toStrictEqual(picture);
    expect(fetched()).toBeGreaterThan(before);
    // Scripts may read those that rest.
    const [stripes, spectrum] = [nativePicture('stripes'), nativePicture('spectrum')];
    for (const [i, drawn] of (await pictures(page)).entries()) {
      expect(drawn).toMatchPicture(i === 0 ? stripes : spectrum, 1);
    }
    const { events } = await seenBy(page);
    expect(events.map((/** @type {any} */ { type }) => type)).toStrictEqual(Array(6).fill('load'));
  });

  test('removed elements return all memory', async ({ openPage }) => {
    const page = await openPage('/plain', { before: watchPage });
    await mountAll(page, [GLASS, GLASS, `${GLASS}?other`], 64);
    expect(page.workers().length).toBeGreaterThan(0);
    await page.evaluate('document.body.replaceChildren()');
    await expect.poll(() => page.workers().length).toBe(0);
  });
});
