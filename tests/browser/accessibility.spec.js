/** Accessibility: axe-core in each state, roles and focus, languages, sizes of the controls. */

import { expect, test } from './fixtures.js';
import {
  alertOf,
  axeViolations,
  boxOf,
  mountPhoto,
  saveScreenshot,
  waitForEvents,
  waitForLoad,
  waitUntil,
} from './page-helpers.js';

/** @typedef {import('@playwright/test').Page} Page */

const GLASS = {
  src: '/photos/glass.ltm',
  alt: 'A window',
  light: 'torch',
  backend: 'cpu',
  controls: '',
  zoom: '',
};

/**
 * Opens a page with one element, under the site's policy.
 *
 * @param {Page} page
 * @param {Record<string, string>} [attributes]
 * @param {string} [lang] the page's language
 */
async function open(page, attributes = {}, lang = 'en') {
  await page.goto(`/strict?lang=${lang}`);
  await mountPhoto(page, { ...GLASS, ...attributes });
  await page.evaluate("photo.style.width = 'min(480px, 100%)'");
}

/** Functions that bring an element into a state. @type {Record<string, (page: Page) => Promise<void>>} */
const STATES = {
  async loading(page) {
    await open(page, { src: '/faults/slow' });
    await page.getByRole('progressbar').waitFor();
  },
  async 'waiting for an interaction'(page) {
    await open(page, { reveal: 'interaction', poster: '/half.png' });
    await page.getByRole('button', { name: 'Light it yourself' }).waitFor();
  },
  async 'lit by a torch'(page) {
    await open(page, { 'autoplay-light': '' });
    await waitForLoad(page);
    await page.getByRole('toolbar').waitFor();
  },
  async 'with the menu of lights'(page) {
    await open(page);
    await waitForLoad(page);
    await page.getByRole('button', { name: 'Light: Torch' }).click();
    await page.getByRole('radiogroup', { name: 'Light' }).waitFor();
  },
  async 'lit by stripes'(page) {
    await open(page, { light: 'stripes' });
    await waitForLoad(page);
  },
  async 'without controls'(page) {
    await open(page, { light: 'flood' });
    await page.evaluate("photo.removeAttribute('controls'), photo.removeAttribute('zoom')");
    await waitForLoad(page);
  },
  async 'zoomed in'(page) {
    await open(page);
    await waitForLoad(page);
    await page.evaluate('photo.view = { zoom: 5, x: 0.5, y: 0.5 }');
    await waitForEvents(page, 'viewchange');
  },
  async 'in full screen'(page) {
    await open(page);
    await waitForLoad(page);
    await page.getByRole('button', { name: 'Full screen' }).click();
    await waitUntil(page, 'document.fullscreenElement === photo');
  },
  async 'with an error'(page) {
    await open(page, { src: '/photos/absent.ltm', poster: '/half.png' });
    await alertOf(page).waitFor();
    await page.locator('relightable-photo summary').click();
  },
};

test('axe finds no violation on a page with a photograph in any state', async ({
  openPage,
  step,
}) => {
  const page = await openPage('/blank');
  for (const [state, enter] of Object.entries(STATES)) {
    await step(`axe finds no violation on a page with a photograph ${state}`, async () => {
      await enter(page);
      expect.soft(await axeViolations(page)).toStrictEqual([]);
      await saveScreenshot(page, `element-${state.replaceAll(' ', '-')}.png`);
    });
  }
});

test.describe('the picture', () => {
  test('is an image with a name, and has a slider under the torch', async ({ openPage }) => {
    const page = await openPage('/blank');
    await open(page);
    await waitForLoad(page);
    await page.getByRole('img', { name: 'A window' }).waitFor();
    const slider = page.getByRole('slider', { name: 'Light' });
    await slider.waitFor({ state: 'attached' });
    expect(await slider.getAttribute('aria-roledescription')).toBe('2D slider');
    await page
      .getByRole('status')
      .getByText('The picture is ready.')
      .waitFor({ state: 'attached' });
    await page.evaluate("photo.light = 'flood'");
    await slider.waitFor({ state: 'detached' });
    expect(await page.locator('relightable-photo').ariaSnapshot()).not.toMatch(/slider|arrow/);
  });

  test('has a focus ring, also in forced colours', async ({ openPage }) => {
    const page = await openPage('/blank');
    await open(page);
    await waitForLoad(page);
    await page.keyboard.press('Tab');
    const ring = page.getByRole('slider');
    const width = await ring.evaluate((element) => getComputedStyle(element).borderTopWidth);
    expect(width).toBe('3px');
    await page.emulateMedia({ forcedColors: 'active' });
    const [shown, system] = await ring.evaluate((element) => {
      const probe = document.createElement('i');
      probe.style.color = 'Highlight';
      element.append(probe);
      return [getComputedStyle(element).borderTopColor, getComputedStyle(probe).color];
    });
    expect(shown).toBe(system);
  });
});

test.describe('texts', () => {
  test('are in the page’s language', async ({ openPage, step }) => {
    const page = await openPage('/blank');
    for (const [lang, light, zoom] of /** @type {const} */ ([
      ['fr', 'Lumière: Torche', 'Agrandir'],
      ['de-CH', 'Licht: Taschenlampe', 'Vergrößern'],
      ['it', 'Luce: Torcia', 'Ingrandisci'],
      ['es', 'Luz: Linterna', 'Ampliar'],
      ['ja', '光: 懐中電灯', '拡大'],
      ['zh-Hans', '光: 手电筒', '放大'],
      ['zh-TW', '光: 手電筒', '放大'],
    ])) {
      await step(`texts are in the page’s language: ${lang}`, async () => {
        await open(page, {}, lang);
        await waitForLoad(page);
        await page.getByRole('button', { name: light, exact: true }).waitFor();
        await page.getByRole('button', { name: zoom, exact: true }).waitFor();
        expect(await axeViolations(page)).toStrictEqual([]);
      });
    }
  });

  test('are in a language of the page', async ({ openPage }) => {
    const page = await openPage('/blank');
    await open(page, {}, 'pt-BR');
    await waitForLoad(page);
    await page.getByRole('button', { name: 'Light: Torch', exact: true }).waitFor();
    await page.evaluate(() => {
      const element = /** @type {any} */ (customElements.get('relightable-photo'));
      element.addTranslation('pt', { light: 'Luz', torch: 'Lanterna' });
    });
    await page.getByRole('button', { name: 'Luz: Lanterna', exact: true }).waitFor();
    await page.getByRole('button', { name: 'Zoom in', exact: true }).waitFor();
    expect(await axeViolations(page)).toStrictEqual([]);
  });

  test('are in the language of the nearest ancestor, or of the browser', async ({ openPage }) => {
    const page = await openPage('/blank', { locale: 'es-MX' });
    await open(page, {}, 'pt');
    await waitForLoad(page);
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

test.describe('controls', () => {
  test('are at least 44 pixels wide and high at every width', async ({ openPage, step }) => {
    const page = await openPage('/blank');
    for (const width of [320, 390, 1440]) {
      await step(
        `controls are at least 44 pixels wide and high, within a page of ${width} pixels`,
        async () => {
          await page.setViewportSize({ width, height: 800 });
          await open(page, { 'autoplay-light': '' });
          await waitForLoad(page);
          await page.getByRole('button', { name: 'Light: Torch' }).click();
          const frame = await boxOf(page.locator('relightable-photo'));
          const targets = [...(await page.getByRole('button').all())];
          for (const radio of await page.getByRole('radio').all())
            targets.push(radio.locator('..'));
          expect(targets.length, String(targets.length)).toBeGreaterThanOrEqual(12);
          for (const target of targets) {
            const box = await boxOf(target);
            expect(box.width, JSON.stringify(box)).toBeGreaterThanOrEqual(44);
            expect(box.height, JSON.stringify(box)).toBeGreaterThanOrEqual(44);
            expect(box.x).toBeGreaterThanOrEqual(frame.x);
            expect(box.x + box.width).toBeLessThanOrEqual(frame.x + frame.width + 0.5);
          }
        },
      );
    }
  });

  test('grow when text is twice as large', async ({ openPage }) => {
    const page = await openPage('/blank', { viewport: { width: 390, height: 800 } });
    await open(page);
    await waitForLoad(page);
    await page.evaluate("document.documentElement.style.fontSize = '32px'");
    await page.getByRole('button', { name: 'Light: Torch' }).click();
    const label = page.getByRole('radiogroup').getByText('Checkerboard');
    const box = await boxOf(label);
    const frame = await boxOf(page.locator('relightable-photo'));
    expect(box.height).toBeGreaterThanOrEqual(32);
    expect(box.x + box.width).toBeLessThanOrEqual(frame.x + frame.width);
    expect(await axeViolations(page)).toStrictEqual([]);
    await saveScreenshot(page, 'element-large-text.png');
  });
});
