/** The loading attribute, posters, the reveal attribute and slots. */

import { expect, test } from './fixtures.js';
import {
  alertOf,
  mountPhoto,
  openAlertDetails,
  waitForEvents,
  waitForFrames,
  waitForLoad,
  waitUntil,
} from './page-helpers.js';

/** @typedef {import('@playwright/test').Page} Page */

const GLASS = { src: '/photos/glass.ltm', alt: 'A window', light: 'torch', backend: 'cpu' };

/** An address that no other test requests. @param {string} name */
const addressOf = (name) => `/photos/glass.ltm?${name}`;

/** @param {Page} page */
const pushDown = async (page, top = 0) => {
  await page.evaluate(`document.body.style.paddingTop = '${top}px'`);
};

test.describe('a photograph', () => {
  /** @type {[loading: string, below: number, fetched: boolean][]} */
  const cases = [
    ['eager', 9000, true],
    ['lazy', 9000, false],
    ['lazy', 1000, true],
  ];
  test('is fetched when it comes near enough for its loading attribute', async ({
    openPage,
    server,
    step,
  }) => {
    const page = await openPage('/blank', { viewport: { width: 800, height: 600 } });
    for (const [loading, below, fetched] of cases) {
      const what = `a photograph ${below} pixels down is ${fetched ? '' : 'not '}fetched`;
      await step(`${what} with loading=${loading}`, async () => {
        await page.goto('/plain');
        await pushDown(page, below);
        const src = addressOf(`${loading}-${below}`);
        await mountPhoto(page, { ...GLASS, src, loading });
        if (fetched) {
          await waitForLoad(page);
        } else {
          await waitForFrames(page);
          expect(server.requestedRanges.has(src)).toBe(false);
          await page.evaluate('photo.scrollIntoView()');
          await waitForLoad(page);
        }
        expect(server.requestedRanges.has(src)).toBeTruthy();
      });
    }
  });

  test('that replaces another before it enters the viewport is fetched alone', async ({
    openPage,
    server,
  }) => {
    const page = await openPage('/plain');
    await pushDown(page, 9000);
    await mountPhoto(page, { ...GLASS, src: addressOf('first'), loading: 'lazy' });
    await waitForFrames(page);
    await page.evaluate(`photo.src = '${addressOf('second')}'`);
    await page.evaluate('photo.scrollIntoView()');
    await waitForLoad(page);
    expect([
      server.requestedRanges.has(addressOf('first')),
      server.requestedRanges.has(addressOf('second')),
    ]).toStrictEqual([false, true]);
  });
});

/** Whether the poster is visible. @param {Page} page */
const isPosterVisible = (page) =>
  page.evaluate(() => {
    const { photo } = /** @type {any} */ (globalThis);
    const image = photo.shadowRoot.querySelector('[part=poster]');
    return !image.hidden && getComputedStyle(image).visibility === 'visible';
  });

test.describe('a poster', () => {
  test('is shown until the photograph is drawn', async ({ openPage }) => {
    const page = await openPage('/plain');
    await mountPhoto(page, { ...GLASS, src: '/faults/slow', poster: '/half.png' });
    await waitUntil(page, "photo.shadowRoot.querySelector('[part=poster]').naturalWidth === 10");
    expect(await isPosterVisible(page)).toBe(true);
    await waitForLoad(page);
    await waitUntil(
      page,
      "getComputedStyle(photo.shadowRoot.querySelector('[part=poster]')).visibility === 'hidden'",
    );
  });

  test('with reveal=interaction fetches nothing before a press', async ({ openPage, server }) => {
    const page = await openPage('/plain');
    const src = addressOf('pressed');
    await mountPhoto(page, { ...GLASS, src, poster: '/half.png', reveal: 'interaction' });
    await page.evaluate("photo.style.width = '320px'");
    await waitForFrames(page);
    expect([server.requestedRanges.has(src), await isPosterVisible(page)]).toStrictEqual([
      false,
      true,
    ]);
    expect(await page.getByRole('slider').count()).toBe(0);
    await page.getByRole('button', { name: 'Light it yourself' }).press('Enter');
    await waitForLoad(page);
    expect(await page.getByRole('button').count()).toBe(0);
    await page.getByRole('slider').waitFor({ state: 'attached' });
  });

  test('with reveal=manual waits for dismissPoster', async ({ openPhoto }) => {
    const page = await openPhoto({ ...GLASS, poster: '/half.png', reveal: 'manual' });
    await waitForFrames(page);
    expect(await isPosterVisible(page)).toBe(true);
    await page.evaluate('photo.dismissPoster()');
    await waitUntil(
      page,
      "getComputedStyle(photo.shadowRoot.querySelector('[part=poster]')).visibility === 'hidden'",
    );
  });

  test('stays with a message when the photograph cannot be shown', async ({ openPage }) => {
    const page = await openPage('/plain');
    await mountPhoto(page, { ...GLASS, src: '/photos/absent.ltm', poster: '/half.png' });
    await alertOf(page).getByText('The picture cannot be shown.').waitFor();
    expect(await isPosterVisible(page)).toBe(true);
    expect(await alertOf(page).getByText('404').isVisible()).toBe(false);
    await (await openAlertDetails(page))
      .getByText(/absent\.ltm .*404/)
      .waitFor({ state: 'visible' });
    // A photograph that loads removes the message.
    await page.evaluate(`photo.src = '${GLASS.src}'`);
    await waitForEvents(page, 'load');
    await alertOf(page).waitFor({ state: 'hidden' });
  });

  test('that is missing is requested once', async ({ openPhoto, server }) => {
    const page = await openPhoto({ ...GLASS, poster: '/no-poster.png', reveal: 'manual' });
    for (let i = 1; i < 9; i += 1) await page.evaluate(`photo.torch = { x: ${i / 9}, y: 0.5 }`);
    expect(server.requestedRanges.get('/no-poster.png')?.length).toBe(1);
    await expect.poll(() => isPosterVisible(page)).toBe(false);
  });
});

test.describe('slots', () => {
  test('replace the built-in parts', async ({ openPage }) => {
    const page = await openPage('/plain');
    await mountPhoto(page, { ...GLASS, src: '/faults/slow', controls: '' });
    await page.evaluate(() => {
      const { photo } = /** @type {any} */ (globalThis);
      photo.style.width = '320px';
      photo.innerHTML =
        '<p slot="poster">My poster</p><p slot="progress">My progress</p>' +
        '<p slot="controls">My controls</p><p slot="error">My message</p>';
    });
    await page.getByText('My poster').waitFor();
    await page.getByText('My progress').waitFor();
    expect(await page.getByRole('progressbar').count()).toBe(0);
    expect(await page.getByText('My message').isVisible()).toBe(false);
    await waitForLoad(page);
    await page.getByText('My progress').waitFor({ state: 'hidden' });
    await page.getByText('My poster').waitFor({ state: 'hidden' });
    await page.getByText('My controls').waitFor();
    expect(await page.getByRole('toolbar').count()).toBe(0);
    await page.evaluate("photo.src = '/photos/absent.ltm'");
    await page.getByText('My message').waitFor();
    expect(await page.getByText('cannot be shown').isVisible()).toBe(false);
  });
});
