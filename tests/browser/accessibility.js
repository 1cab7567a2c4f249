/** What axe-core finds, in each state; languages; what people set in their systems. */

import assert from 'node:assert/strict';
import { join } from 'node:path';
import { describe, test } from 'node:test';
import { happenedUntil, loaded, message, mount, openPage } from './browser.js';
import { SCREENSHOTS } from './photos.js';

/** @typedef {import('playwright-core').Page} Page */
/** @typedef {import('node:test').TestContext} TestContext */

const GLASS = {
  src: '/photos/stained-glass.ltm',
  alt: 'A window',
  light: 'torch',
  backend: 'cpu',
  controls: '',
  zoom: '',
};

/**
 * An element on a page that is as strict as the element can bear.
 *
 * @param {TestContext} t
 * @param {Record<string, string>} [attributes]
 * @param {import('playwright-core').BrowserContextOptions & { lang?: string }} [options]
 */
async function opened(t, attributes = {}, { lang = 'en', ...options } = {}) {
  const page = await openPage(t, `/strict?lang=${lang}`, options);
  await mount(page, { ...GLASS, ...attributes });
  await page.evaluate("photo.style.width = 'min(480px, 100%)'");
  return page;
}

/** @param {Page} page */
async function violates(page) {
  const results = await page.evaluate('axe.run()');
  return results.violations.map(
    (/** @type {any} */ { id, nodes }) =>
      `${id}: ${nodes.map((/** @type {any} */ node) => node.html).join(' ')}`,
  );
}

/** @type {Record<string, (t: TestContext) => Promise<Page>>} */
const STATES = {
  async loading(t) {
    const page = await opened(t, { src: '/faults/slow' });
    await page.getByRole('progressbar').waitFor();
    return page;
  },
  async 'waiting for a press'(t) {
    const page = await opened(t, { reveal: 'interaction', poster: '/half.png' });
    await page.getByRole('button', { name: 'Light it yourself' }).waitFor();
    return page;
  },
  async 'lit by a torch'(t) {
    const page = await opened(t, { 'autoplay-light': '' });
    await loaded(page);
    await page.getByRole('toolbar').waitFor();
    return page;
  },
  async 'with its lights open'(t) {
    const page = await opened(t);
    await loaded(page);
    await page.getByRole('button', { name: 'Light: Torch' }).click();
    await page.getByRole('radiogroup', { name: 'Light' }).waitFor();
    return page;
  },
  async 'lit by stripes'(t) {
    const page = await opened(t, { light: 'stripes' });
    await loaded(page);
    return page;
  },
  async 'without controls'(t) {
    const page = await opened(t, { light: 'flood' });
    await page.evaluate("photo.removeAttribute('controls'), photo.removeAttribute('zoom')");
    await loaded(page);
    return page;
  },
  async 'zoomed in'(t) {
    const page = await opened(t);
    await loaded(page);
    await page.evaluate('photo.view = { zoom: 5, x: 0.5, y: 0.5 }');
    await happenedUntil(page, 'viewchange');
    return page;
  },
  async 'on the whole screen'(t) {
    const page = await opened(t);
    await loaded(page);
    await page.getByRole('button', { name: 'Full screen' }).click();
    await page.waitForFunction('document.fullscreenElement === photo');
    return page;
  },
  async 'that cannot be shown'(t) {
    const page = await opened(t, { src: '/photos/absent.ltm', poster: '/half.png' });
    await message(page).waitFor();
    await page.locator('relightable-photo summary').click();
    return page;
  },
};

describe('axe finds nothing on a page with a photograph', () => {
  for (const [state, enter] of Object.entries(STATES)) {
    test(state, async (t) => {
      const page = await enter(t);
      assert.deepEqual(await violates(page), []);
      await page.screenshot({
        path: join(SCREENSHOTS, `element-${state.replaceAll(' ', '-')}.png`),
      });
    });
  }
});

describe('the picture', () => {
  test('is an image with a name, and under its torch a slider', async (t) => {
    const page = await opened(t);
    await loaded(page);
    await page.getByRole('img', { name: 'A window' }).waitFor();
    const slider = page.getByRole('slider', { name: 'Light' });
    await slider.waitFor({ state: 'attached' });
    assert.equal(await slider.getAttribute('aria-roledescription'), '2D slider');
    await page
      .getByRole('status')
      .getByText('The picture is ready.')
      .waitFor({ state: 'attached' });
    await page.evaluate("photo.light = 'flood'");
    await slider.waitFor({ state: 'detached' });
    assert.doesNotMatch(await page.locator('relightable-photo').ariaSnapshot(), /slider|arrow/);
  });

  test('shows the focus of its light', async (t) => {
    const page = await opened(t);
    await loaded(page);
    await page.keyboard.press('Tab');
    const ring = page.getByRole('slider');
    const width = await ring.evaluate((element) => getComputedStyle(element).borderTopWidth);
    assert.equal(width, '3px');
    await page.emulateMedia({ forcedColors: 'active' });
    const [shown, system] = await ring.evaluate((element) => {
      const probe = document.createElement('i');
      probe.style.color = 'Highlight';
      element.append(probe);
      return [getComputedStyle(element).borderTopColor, getComputedStyle(probe).color];
    });
    assert.equal(shown, system);
  });
});

describe('words', () => {
  for (const [lang, light, zoom] of /** @type {const} */ ([
    ['fr', 'Lumière: Torche', 'Agrandir'],
    ['de-CH', 'Licht: Taschenlampe', 'Vergrößern'],
    ['it', 'Luce: Torcia', 'Ingrandisci'],
    ['es', 'Luz: Linterna', 'Ampliar'],
    ['ja', '光: 懐中電灯', '拡大'],
    ['zh-Hans', '光: 手电筒', '放大'],
  ])) {
    test(`are in the page’s language, ${lang}`, async (t) => {
      const page = await opened(t, {}, { lang });
      await loaded(page);
      await page.getByRole('button', { name: light, exact: true }).waitFor();
      await page.getByRole('button', { name: zoom, exact: true }).waitFor();
      assert.deepEqual(await violates(page), []);
    });
  }

  test('are in the language of where the element stands, or else of the browser', async (t) => {
    const page = await opened(t, {}, { lang: 'pt', locale: 'es-MX' });
    await loaded(page);
    await page.getByRole('button', { name: 'Ampliar' }).waitFor();
    await page.evaluate("photo.lang = 'de'");
    await page.getByRole('button', { name: 'Vergrößern' }).waitFor();
    await page.evaluate(() => {
      const { photo } = /** @type {any} */ (globalThis);
      photo.removeAttribute('lang');
      const host = document.createElement('section');
      host.lang = 'fr';
      host.attachShadow({ mode: 'open' }).append(photo);
      document.body.append(host);
    });
    await page.getByRole('button', { name: 'Agrandir' }).waitFor();
  });
});

describe('buttons', () => {
  for (const width of [320, 390, 1440]) {
    test(`are large enough for fingers at ${width} pixels, and within the picture`, async (t) => {
      const page = await opened(t, { 'autoplay-light': '' }, { viewport: { width, height: 800 } });
      await loaded(page);
      await page.getByRole('button', { name: 'Light: Torch' }).click();
      const frame = await page.locator('relightable-photo').boundingBox();
      const places = [...(await page.getByRole('button').all())];
      for (const radio of await page.getByRole('radio').all()) places.push(radio.locator('..'));
      assert.ok(frame && places.length >= 12, String(places.length));
      for (const place of places) {
        const box = await place.boundingBox();
        assert.ok(box && box.width >= 44 && box.height >= 44, JSON.stringify(box));
        assert.ok(box.x >= frame.x && box.x + box.width <= frame.x + frame.width + 0.5);
      }
    });
  }

  test('grow with text of twice the size', async (t) => {
    const page = await opened(t, {}, { viewport: { width: 390, height: 800 } });
    await loaded(page);
    await page.evaluate("document.documentElement.style.fontSize = '32px'");
    await page.getByRole('button', { name: 'Light: Torch' }).click();
    const label = page.getByRole('radiogroup').getByText('Checkerboard');
    const box = await label.boundingBox();
    const frame = await page.locator('relightable-photo').boundingBox();
    assert.ok(box && frame && box.height >= 32 && box.x + box.width <= frame.x + frame.width);
    assert.deepEqual(await violates(page), []);
    await page.screenshot({ path: join(SCREENSHOTS, 'element-large-text.png') });
  });
});
