/** When photographs are fetched, what is shown until then, and where they cannot be. */

import assert from 'node:assert/strict';
import { describe, test } from 'node:test';
import { asked, details, happenedUntil, loaded, message, mount, openPage } from './browser.js';

/** @typedef {import('playwright-core').Page} Page */

const GLASS = { src: '/photos/glass.ltm', alt: 'A window', light: 'torch', backend: 'cpu' };

/** An address of its own. @param {string} name */
const at = (name) => `/photos/glass.ltm?${name}`;

/** @param {Page} page */
const scrolledTo = async (page, top = 0) => {
  await page.evaluate(`document.body.style.paddingTop = '${top}px'`);
};

describe('a photograph', () => {
  /** @type {[loading: string, below: number, fetched: boolean][]} */
  const cases = [
    ['eager', 9000, true],
    ['auto', 9000, false],
    ['auto', 1000, true],
    ['lazy', 1000, false],
    ['lazy', 100, true],
  ];
  for (const [loading, below, fetched] of cases) {
    test(`${below} pixels down is ${fetched ? '' : 'not '}fetched with ${loading}`, async (t) => {
      const page = await openPage(t, '/bench', { viewport: { width: 800, height: 600 } });
      await scrolledTo(page, below);
      const src = at(`${loading}-${below}`);
      await mount(page, { ...GLASS, src, loading });
      if (fetched) {
        await loaded(page);
      } else {
        await page.waitForTimeout(400);
        assert.equal(asked.has(src), false);
        await page.evaluate('photo.scrollIntoView()');
        await loaded(page);
      }
      assert.ok(asked.has(src));
    });
  }

  test('that is another before it was seen is fetched alone', async (t) => {
    const page = await openPage(t, '/bench');
    await scrolledTo(page, 9000);
    await mount(page, { ...GLASS, src: at('first'), loading: 'lazy' });
    await page.waitForTimeout(200);
    await page.evaluate(`photo.src = '${at('second')}'`);
    await page.evaluate('photo.scrollIntoView()');
    await loaded(page);
    assert.deepEqual([asked.has(at('first')), asked.has(at('second'))], [false, true]);
  });
});

/** What is seen of the poster. @param {Page} page */
const posterShown = (page) =>
  page.evaluate(() => {
    const { photo } = /** @type {any} */ (globalThis);
    const image = photo.shadowRoot.querySelector('[part=poster]');
    return !image.hidden && getComputedStyle(image).visibility === 'visible';
  });

describe('a poster', () => {
  test('is shown until the photograph is drawn', async (t) => {
    const page = await openPage(t, '/bench');
    await mount(page, { ...GLASS, src: '/faults/slow', poster: '/half.png' });
    await page.waitForFunction(
      "photo.shadowRoot.querySelector('[part=poster]').naturalWidth === 10",
    );
    assert.equal(await posterShown(page), true);
    await loaded(page);
    await page.waitForFunction(
      "getComputedStyle(photo.shadowRoot.querySelector('[part=poster]')).visibility === 'hidden'",
    );
  });

  test('waits for a press, before which nothing is fetched', async (t) => {
    const page = await openPage(t, '/bench');
    const src = at('pressed');
    await mount(page, { ...GLASS, src, poster: '/half.png', reveal: 'interaction' });
    await page.evaluate("photo.style.width = '320px'");
    await page.waitForTimeout(300);
    assert.deepEqual([asked.has(src), await posterShown(page)], [false, true]);
    assert.equal(await page.getByRole('slider').count(), 0);
    await page.getByRole('button', { name: 'Light it yourself' }).press('Enter');
    await loaded(page);
    assert.equal(await page.getByRole('button').count(), 0);
    await page.getByRole('slider').waitFor({ state: 'attached' });
  });

  test('waits for a script', async (t) => {
    const page = await openPage(t, '/bench');
    await mount(page, { ...GLASS, poster: '/half.png', reveal: 'manual' });
    await loaded(page);
    await page.waitForTimeout(200);
    assert.equal(await posterShown(page), true);
    await page.evaluate('photo.dismissPoster()');
    await page.waitForFunction(
      "getComputedStyle(photo.shadowRoot.querySelector('[part=poster]')).visibility === 'hidden'",
    );
  });

  test('stays where the photograph cannot be shown, with a message', async (t) => {
    const page = await openPage(t, '/bench');
    await mount(page, { ...GLASS, src: '/photos/absent.ltm', poster: '/half.png' });
    await message(page).getByText('The picture cannot be shown.').waitFor();
    assert.equal(await posterShown(page), true);
    assert.equal(await message(page).getByText('404').isVisible(), false);
    await (await details(page)).getByText(/absent\.ltm .*404/).waitFor({ state: 'visible' });
    // It goes once there is a picture.
    await page.evaluate(`photo.src = '${GLASS.src}'`);
    await happenedUntil(page, 'load');
    await message(page).waitFor({ state: 'hidden' });
  });

  test('that is missing is asked for once', async (t) => {
    const page = await openPage(t, '/bench');
    await mount(page, { ...GLASS, poster: '/no-poster.png', reveal: 'manual' });
    await loaded(page);
    for (let i = 1; i < 9; i += 1) await page.evaluate(`photo.torch = { x: ${i / 9}, y: 0.5 }`);
    assert.equal(asked.get('/no-poster.png')?.length, 1);
    assert.equal(await posterShown(page), false);
  });
});

describe('slots', () => {
  test('take the place of what is built in', async (t) => {
    const page = await openPage(t, '/bench');
    await mount(page, { ...GLASS, src: '/faults/slow', controls: '' });
    await page.evaluate(() => {
      const { photo } = /** @type {any} */ (globalThis);
      photo.style.width = '320px';
      photo.innerHTML =
        '<p slot="poster">Poster of mine</p><p slot="progress">Progress of mine</p>' +
        '<p slot="controls">Controls of mine</p><p slot="error">Message of mine</p>';
    });
    await page.getByText('Poster of mine').waitFor();
    await page.getByText('Progress of mine').waitFor();
    assert.equal(await page.getByRole('progressbar').count(), 0);
    assert.equal(await page.getByText('Message of mine').isVisible(), false);
    await loaded(page);
    await page.getByText('Progress of mine').waitFor({ state: 'hidden' });
    await page.getByText('Poster of mine').waitFor({ state: 'hidden' });
    await page.getByText('Controls of mine').waitFor();
    assert.equal(await page.getByRole('toolbar').count(), 0);
    await page.evaluate("photo.src = '/photos/absent.ltm'");
    await page.getByText('Message of mine').waitFor();
    assert.equal(await page.getByText('cannot be shown').isVisible(), false);
  });
});
