/** The page "Recover" with a camera: Chromium's fake camera plays a film of the patterns, in order and with delay. */

import { execFileSync } from 'node:child_process';
import { mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { Uint8ArrayReader, Uint8ArrayWriter, ZipReader } from '@zip.js/zip.js';
import { chromiumOptions } from '../../www/tools/chromium.js';
import { writeFilm } from './camera-film.js';
import { expect, note, test } from './fixtures.js';
import { axeViolations, horizontalOverflow, saveScreenshot } from './page-helpers.js';

/** @typedef {import('@playwright/test').Page} Page */

const repository = join(import.meta.dirname, '../..');
const axe = readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');
const FILM = join(repository, 'target/browser-tests/camera.y4m');
const PATTERNS = 30;
/** As the page's: see `CameraCapture`. */
const LIGHT_SIDE = 32;
const SEED = 1;

// The headless shell has no cameras.
const launchOptions = chromiumOptions(
  '--disable-gpu-compositing',
  '--use-fake-device-for-media-stream',
  `--use-file-for-fake-video-capture=${FILM}`,
);
test.use({ launchOptions });
// In one worker: two would write the film at once. The film does not wait for a page that a busy machine holds up.
test.describe.configure({ mode: 'default', retries: 1 });

/** Writes the files of a zip into a folder. @param {string} zip @param {string} folder */
async function unpack(zip, folder) {
  const reader = new ZipReader(new Uint8ArrayReader(readFileSync(zip)));
  for (const entry of await reader.getEntries()) {
    if (entry.directory) continue;
    const path = join(folder, entry.filename);
    mkdirSync(dirname(path), { recursive: true });
    // Checks the checksum as well.
    writeFileSync(path, await entry.getData(new Uint8ArrayWriter(), { checkSignature: true }));
  }
  await reader.close();
}

/** The held-out SNR of a recovery of a capture folder by ltm-export, before its file is quantised. @param {string} folder */
function nativeHeldOutSnr(folder) {
  const program = join(repository, 'target/release/ltm-export');
  const file = join(folder, 'native.ltm');
  execFileSync(program, ['recover', folder, '-o', file, '--lossless'], { stdio: 'pipe' });
  const evaluated = execFileSync(program, ['evaluate', file, folder, '--json'], { stdio: 'pipe' });
  return Number(JSON.parse(evaluated.toString()).heldout_snr_db);
}

/** Opens camera and pattern window. @param {Page} page */
async function prepare(page) {
  await page.getByLabel('Your camera and a second screen').check();
  const [patterns] = await Promise.all([
    page.waitForEvent('popup'),
    page.getByRole('button', { name: 'Open the pattern window' }).click(),
  ]);
  await page.getByRole('button', { name: 'Start the camera' }).click();
  await expect(page.getByRole('button', { name: 'Photograph all patterns' })).toBeEnabled();
  return patterns;
}

test.beforeAll(async () => {
  await writeFilm(FILM, { lightSide: LIGHT_SIDE, patterns: PATTERNS, seed: SEED });
});

test('photographs patterns on a second screen, and recovers as ltm-export does', async ({
  openPage,
  step,
}) => {
  test.slow();
  // Colours in transition would have too little contrast.
  const page = await openPage('/recover.html', {
    permissions: ['camera'],
    reducedMotion: 'reduce',
  });
  await page.evaluate(axe);
  const patterns = await prepare(page);
  await page.locator('#camera-side').selectOption('64');
  await page.locator('#camera-patterns').selectOption(String(PATTERNS));
  await page.getByRole('button', { name: 'Photograph all patterns' }).click();

  await step('the window shows square patterns', async () => {
    const canvas = await patterns.evaluate(() => {
      const { width, height, clientWidth } = /** @type {HTMLCanvasElement} */ (
        document.querySelector('canvas')
      );
      return { width, height, remainder: (clientWidth * devicePixelRatio) % width };
    });
    expect(canvas).toStrictEqual({ width: LIGHT_SIDE, height: LIGHT_SIDE, remainder: 0 });
  });
  await step('axe finds nothing while it photographs', async () => {
    await expect(page.locator('#job-text')).toContainText('Photographing');
    expect(await axeViolations(page)).toStrictEqual([]);
    expect(await horizontalOverflow(page)).toBe(0);
    await saveScreenshot(page, 'recover-camera.png');
  });

  const facts = page.locator('#facts');
  await expect(facts).toContainText('dB on pictures', { timeout: 200_000 });
  const heldOut = Number(/SNR ([\d.]+) dB on pictures/.exec(await facts.innerText())?.[1]);
  await expect(page.locator('#camera-status')).toContainText('could not fix this: exposure, focus');
  expect(
    Number(/least (\d+) frames/.exec(await page.locator('#camera-status').innerText())?.[1]),
  ).toBeGreaterThanOrEqual(2);

  const [download] = await Promise.all([
    page.waitForEvent('download'),
    page.getByRole('button', { name: 'Save the photographs' }).click(),
  ]);
  expect(download.suggestedFilename()).toBe('camera.zip');
  const folder = mkdtempSync(join(tmpdir(), 'camera-'));
  await unpack(await download.path(), folder);
  const native = nativeHeldOutSnr(folder);
  rmSync(folder, { recursive: true });
  note(`held-out SNR ${heldOut} dB in the page, ${native.toFixed(2)} dB natively`);
  expect(heldOut).toBeGreaterThan(20);
  expect(Math.abs(heldOut - native)).toBeLessThan(0.1);
});

test('says why there is no camera, or no pattern window', async ({ openPage, step }) => {
  const page = await openPage('/recover.html', { permissions: ['camera'] });
  const fault = page.getByRole('alert');
  const start = page.getByRole('button', { name: 'Start the camera' });
  await page.getByLabel('Your camera and a second screen').check();

  for (const [error, code] of [
    ['NotFoundError', 'camera-missing'],
    ['NotReadableError', 'camera-busy'],
  ]) {
    await step(`the browser answers ${error}`, async () => {
      await page.evaluate((error) => {
        navigator.mediaDevices.getUserMedia = () => Promise.reject(new DOMException('', error));
      }, error);
      await start.click();
      await expect(fault).toContainText(`Code: ${code}`);
      await expect(start).toBeEnabled();
    });
  }

  await step('the browser gives pages no camera', async () => {
    // As in a page without a secure connection.
    await page.evaluate(() =>
      Object.defineProperty(navigator, 'mediaDevices', { value: undefined, configurable: true }),
    );
    await start.click();
    await expect(fault).toContainText('Code: camera-unsupported');
  });

  await step('the pattern window is blocked', async () => {
    await page.evaluate(() => {
      window.open = () => null;
    });
    const open = page.getByRole('button', { name: 'Open the pattern window' });
    await open.click();
    await expect(fault).toContainText('Code: patterns-blocked');
    await expect(open).toBeEnabled();
  });
});

test('says what is at fault, with a code', async ({ openPage, step }) => {
  const page = await openPage('/recover.html');
  const fault = page.getByRole('alert');
  const start = page.getByRole('button', { name: 'Start the camera' });

  await step('the permission is refused', async () => {
    await page.getByLabel('Your camera and a second screen').check();
    await start.click();
    await expect(fault).toContainText('Code: camera-refused');
  });
  await page.context().grantPermissions(['camera']);

  await step('the tab is hidden and seen again, and the pattern window is closed', async () => {
    const patterns = await prepare(page);
    await page.getByRole('button', { name: 'Photograph all patterns' }).click();
    await expect(page.locator('#job-text')).toContainText('Photographing');
    for (const hidden of [true, false]) {
      await page.evaluate((hidden) => {
        Object.defineProperty(document, 'hidden', { value: hidden, configurable: true });
        document.dispatchEvent(new Event('visibilitychange'));
      }, hidden);
      const status = page.locator('#camera-status');
      await (hidden ? expect(status).toContainText('Paused') : expect(status).toBeEmpty());
    }
    await patterns.close();
    await expect(fault).toContainText('Code: patterns-closed');
    await expect(page.getByRole('button', { name: 'Photograph all patterns' })).toBeDisabled();
  });

  await step('the camera vanishes', async () => {
    await prepare(page);
    await page.getByRole('button', { name: 'Photograph all patterns' }).click();
    await expect(page.locator('#job-text')).toContainText('Photographing');
    await page.locator('#camera-preview').evaluate((video) => {
      const [track] = /** @type {any} */ (video).srcObject.getVideoTracks();
      track.stop();
      // A script that stops a track gets no event, unlike one whose device is unplugged.
      track.dispatchEvent(new Event('ended'));
    });
    await expect(fault).toContainText('Code: camera-lost');
    await expect(page.locator('#camera-view')).toBeHidden();
  });

  await step('leaving the camera ends it', async () => {
    const patterns = await prepare(page);
    await page.getByLabel('A simulated object').check();
    await expect.poll(() => patterns.isClosed()).toBe(true);
    await expect(page.locator('#fault')).toBeEmpty();
  });
});
