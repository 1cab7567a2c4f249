/** Without a network the element says so, and loads once the network returns or a visitor asks for it. */

import { expect, test } from './fixtures.js';
import {
  alertOf,
  capturePicture,
  countEvents,
  mountPhoto,
  skipPausesUntil,
  waitForEvents,
} from './page-helpers.js';
import { glassBytes, nativePicture } from './test-photos.js';

/** @typedef {import('@playwright/test').Page} Page */

const GLASS = { src: '/photos/glass.ltm', alt: 'A window', light: 'spectrum', backend: 'cpu' };
const OFFLINE = /You are offline/;

/** @param {Page} page @param {boolean} isOffline */
const setOffline = (page, isOffline) => page.context().setOffline(isOffline);

/** @param {Page} page */
async function expectOffline(page) {
  const error = (await waitForEvents(page, 'error')).find(({ type }) => type === 'error');
  expect(error?.['code'], String(error?.['message'])).toBe('offline');
  await expect(alertOf(page).getByText(OFFLINE)).toBeVisible();
}

/** @param {Page} page */
async function expectPicture(page) {
  await waitForEvents(page, 'load');
  await expect(alertOf(page)).toBeHidden();
  expect(await capturePicture(page)).toMatchPicture(nativePicture('spectrum'), 1);
}

test.describe('without a network', () => {
  test('an element reports offline, and loads by itself when the network returns', async ({
    openPage,
  }) => {
    const page = await openPage('/plain');
    await setOffline(page, true);
    await mountPhoto(page, GLASS);
    await expectOffline(page);
    await setOffline(page, false);
    await expectPicture(page);
    expect(await countEvents(page, 'error')).toBe(1);
  });

  test('an element whose photograph is cached reports its missing modules and scripts as offline', async ({
    openPage,
  }) => {
    const page = await openPage('/plain');
    await page.route('**/photos/glass.ltm', (route) => route.fulfill({ body: glassBytes() }));
    await setOffline(page, true);
    await mountPhoto(page, GLASS);
    await expectOffline(page);
    await setOffline(page, false);
    await expectPicture(page);
  });

  test('a transfer that breaks off is offline', async ({ openPage }) => {
    const page = await openPage('/plain');
    const cut = page.waitForEvent('requestfailed');
    await mountPhoto(page, { ...GLASS, src: '/faults/cut' });
    await cut;
    await setOffline(page, true);
    await expectOffline(page);
  });

  test('a photograph that is loaded stays', async ({ openPhoto }) => {
    const page = await openPhoto(GLASS);
    await setOffline(page, true);
    expect(await capturePicture(page, { light: 'stripes' })).toMatchPicture(
      nativePicture('stripes'),
      1,
    );
    expect(await countEvents(page, 'error')).toBe(0);
  });
});

test.describe('the button in the error message', () => {
  test('loads the photograph again, by pointer and keyboard', async ({ openPage }) => {
    const page = await openPage('/plain');
    let isDown = true;
    await page.route('**/photos/glass.ltm', (route) =>
      isDown ? route.fulfill({ status: 404 }) : route.continue(),
    );
    await mountPhoto(page, GLASS);
    await page.evaluate("void (photo.style.width = '400px')");
    const button = page.getByRole('button', { name: 'Try again' });
    await button.click();
    await waitForEvents(page, 'error', 2);
    await expect(alertOf(page)).toBeVisible();
    isDown = false;
    await page.evaluate('void document.activeElement.blur()');
    await page.keyboard.press('Tab');
    await expect(button).toBeFocused();
    await page.keyboard.press('Enter');
    await expectPicture(page);
    expect(await page.evaluate('document.activeElement === photo'), 'the focus stays').toBe(true);
  });

  test('is in the page’s language, and absent without a photograph', async ({ openPage }) => {
    const page = await openPage('/plain');
    await mountPhoto(page, { ...GLASS, src: '/photos/absent.ltm', lang: 'de' });
    await page.getByRole('button', { name: 'Erneut versuchen' }).waitFor();
    await page.evaluate("void photo.removeAttribute('src')");
    await waitForEvents(page, 'error', 2);
    await expect(page.locator('relightable-photo').getByRole('button')).toBeHidden();
  });
});

test('a server that cannot be reached is tried again when the network returns', async ({
  openPage,
}) => {
  const page = await openPage('/plain', { fakeClock: true });
  await page.route('**/photos/glass.ltm', (route) => route.abort());
  await skipPausesUntil(page, 'error', () => mountPhoto(page, GLASS));
  const [error] = (await waitForEvents(page, 'error')).filter(({ type }) => type === 'error');
  expect(error?.['code']).toBe('http-network');
  await page.unroute('**/photos/glass.ltm');
  await page.evaluate("void dispatchEvent(new Event('online'))");
  await expectPicture(page);
});
