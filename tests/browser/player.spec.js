/** The pattern player that `ltm-export patterns` writes: pixel by pixel, in order, from a folder without a server. */

import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { decodePng } from '../../www/tools/pictures.js';
import { expect, test } from './fixtures.js';
import { axeViolations } from './page-helpers.js';

const PROGRAM = join(import.meta.dirname, '../../target/release/ltm-export');
const AXE = join(import.meta.dirname, '../../node_modules/axe-core/axe.min.js');
const DISPLAY = { width: 640, height: 480 };

/** @type {string} */
let folder;
test.beforeAll(() => {
  folder = mkdtempSync(join(tmpdir(), 'pattern-player-'));
  const size = ['--screen', '640x480', '--light', '12x8', '--patterns', '3'];
  execFileSync(PROGRAM, ['patterns', '-o', join(folder, 'session'), ...size], { stdio: 'pipe' });
});
test.afterAll(() => rmSync(folder, { recursive: true, force: true }));

/** Opens the player in a window of `viewport`. @param {import('@playwright/test').Browser} browser */
async function openPlayer(browser, viewport = DISPLAY) {
  const context = await browser.newContext({ viewport });
  const page = await context.newPage();
  await page.goto(pathToFileURL(join(folder, 'session/player.html')).href);
  return page;
}

/** @type {{ picture: string }[]} */
const pictures = [];
/** The picture that the display shall show. @param {number} i */
function expected(i) {
  if (pictures.length === 0) {
    const json = readFileSync(join(folder, 'session/sequence.json'), 'utf8');
    pictures.push(...JSON.parse(json).pictures);
  }
  return decodePng(readFileSync(join(folder, 'session', pictures[i]?.picture ?? '')));
}

/** @param {import('@playwright/test').Page} page @param {number} i */
async function expectShown(page, i) {
  await expect(page.locator('#number')).toHaveText(String(i + 1));
  await expect
    .poll(async () => Buffer.compare(decodePng(await page.screenshot()).data, expected(i).data))
    .toBe(0);
}

test('pictures are shown pixel by pixel, in order, and again after a reload', async ({
  browser,
}) => {
  const page = await openPlayer(browser);
  await page.click('#here');
  await expectShown(page, 0);
  await page.keyboard.press('Space');
  await expectShown(page, 1);
  for (const key of ['ArrowRight', 'PageDown', 'Enter']) await page.keyboard.press(key);
  await expectShown(page, 4);
  await page.keyboard.press('PageUp');
  await expectShown(page, 3);
  await page.mouse.click(300, 200);
  await expectShown(page, 4);
  for (let i = 5; i <= 12; i += 1) await page.keyboard.press('Space');
  await expectShown(page, 12);
  await page.reload();
  await expect(page.locator('#number')).toHaveText('13');
  await page.click('#here');
  await expectShown(page, 12);
  // Past the last picture, the page says so.
  const count = pictures.length;
  for (let i = 13; i <= count; i += 1) await page.keyboard.press('Space');
  await expect(page.getByRole('alert')).toHaveText('That was the last picture.');
  await page.click('#restart');
  await expect(page.locator('#number')).toHaveText('1');
  await page.context().close();
});

test('pictures follow by time', async ({ browser }) => {
  const page = await openPlayer(browser);
  await page.clock.install();
  await page.selectOption('#pace', 'time');
  await page.fill('#interval', '5');
  await page.click('#here');
  await page.clock.runFor(1000);
  await expectShown(page, 0);
  await page.clock.runFor(5000);
  await expectShown(page, 1);
  await page.clock.runFor(5000);
  await expectShown(page, 2);
  await page.context().close();
});

test('a window whose pixels are not those of the pictures is refused with the remedy', async ({
  browser,
}) => {
  const page = await openPlayer(browser, { width: 800, height: 600 });
  await page.click('#here');
  const alert = page.getByRole('alert');
  await expect(alert).toContainText(
    'The pictures have 640 × 480 pixels, but the window has 800 × 600',
  );
  await expect(alert).toContainText('ltm-export patterns --screen 800x600');
  await page.context().close();
});

test('another window shows the pictures, and this one the operator’s view', async ({ browser }) => {
  const page = await openPlayer(browser);
  const opened = page.waitForEvent('popup');
  await page.click('#there');
  const display = await opened;
  await display.setViewportSize(DISPLAY);
  await display.getByRole('button').click();
  await expectShown2(0);
  await page.click('#next');
  await expectShown2(1);
  await expect(page.locator('#name')).toContainText('flood');
  await display.close();
  await page.click('#next');
  await expect(page.locator('#number')).toHaveText('3');
  /** @param {number} i */
  async function expectShown2(i) {
    await expect
      .poll(async () =>
        Buffer.compare(decodePng(await display.screenshot()).data, expected(i).data),
      )
      .toBe(0);
  }
  await page.context().close();
});

test('axe finds no violation, light and dark', async ({ browser }) => {
  for (const colorScheme of /** @type {const} */ (['light', 'dark'])) {
    const page = await openPlayer(browser, { width: 360, height: 700 });
    await page.emulateMedia({ colorScheme });
    await page.addScriptTag({ path: AXE });
    expect(await axeViolations(page)).toStrictEqual([]);
    await page.context().close();
  }
});
