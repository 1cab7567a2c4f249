/** The gallery page and its first picture. */

import { join } from 'node:path';
import { brightest, encodePng } from '../../www/tools/pictures.js';
import { expect, test } from './fixtures.js';
import {
  boxOf,
  dominantColour,
  saveScreenshot,
  screenPicture,
  waitForFrames,
  waitUntil,
} from './page-helpers.js';

/** @param {import('@playwright/test').Page} page */
async function waitUntilDrawn(page) {
  await page.waitForFunction(() => document.querySelector('relightable-photo')?.activeBackend);
  await page.locator('#photo canvas').waitFor();
  // The progress bar disappears when the whole photograph has loaded.
  await page.locator('#photo').getByRole('progressbar').waitFor({ state: 'hidden' });
}

/** Centre and mean of the brightness on the screen. @param {import('@playwright/test').Page} page */
async function brightnessOf(page) {
  return brightest(await screenPicture(page, '#photo'));
}

test.describe('the gallery', () => {
  for (const [backend, title] of [
    ['webgpu', 'WebGPU'],
    ['webgl2', 'WebGL2'],
    ['cpu', 'CPU'],
  ]) {
    test(`draws on ${backend}, and its torch follows the pointer`, async ({ openPage }) => {
      const page = await openPage('/blank');
      // Software renderers of WebGPU and WebGL2 take seconds for a frame of the gallery's own photograph.
      if (backend !== 'cpu') {
        await page.route('**/photos/stained-glass.ltm', (route) =>
          route.continue({ url: new URL('/photos/glass.ltm', route.request().url()).href }),
        );
      }
      await page.goto(`/?light=torch&backend=${backend}`);
      await waitUntilDrawn(page);
      await page.getByRole('status').getByText(`${title} (`).waitFor();
      const box = await boxOf(page.locator('#photo'));
      await page.mouse.move(box.x + 0.25 * box.width, box.y + 0.5 * box.height);
      await expect.poll(async () => (await brightnessOf(page)).x).toBeLessThan(0.35);
      await page.mouse.move(box.x + 0.75 * box.width, box.y + 0.5 * box.height);
      await expect.poll(async () => (await brightnessOf(page)).x).toBeGreaterThan(0.65);
    });
  }

  test('has a radio button for each light, and a menu that changes the backend', async ({
    openPage,
    step,
  }) => {
    const page = await openPage('/');
    await waitUntilDrawn(page);

    await step('it has a radio button for each light, for pointer and keyboard', async () => {
      const light = () => page.evaluate("document.getElementById('photo').activeLight");
      expect(await light()).toBe('flood');
      for (const name of ['Torch', 'Flood', 'Checkerboard', 'Spectrum', 'Stripes']) {
        await page.getByRole('radio', { name }).check();
        expect(await light()).toBe(name.toLowerCase());
      }
      await page.keyboard.press('ArrowRight');
      expect(await light()).toBe('checkerboard');
      expect(page.url()).toMatch(/light=checkerboard/);
    });

    await step('it has its own brightness under each light', async () => {
      const means = [];
      for (const name of ['Flood', 'Torch', 'Spectrum']) {
        await page.getByRole('radio', { name }).check();
        // Draws the new light.
        await page.evaluate("document.getElementById('photo').toBlob().then(() => {})");
        await waitForFrames(page, 2);
        means.push((await brightnessOf(page)).mean);
        await saveScreenshot(page.locator('.hero .frame'), `${name.toLowerCase()}.png`);
      }
      const [flood = 0, torch = 0, spectrum = 0] = means;
      expect(flood, String(means)).toBeGreaterThan(spectrum);
      expect(spectrum, String(means)).toBeGreaterThan(torch);
      expect(torch, String(means)).toBeGreaterThan(2);
    });

    await step('it has a menu that changes the backend', async () => {
      await page.getByLabel('Backend:').selectOption('CPU');
      await page
        .getByRole('status')
        .getByText(/CPU \(simd128, \d workers?\)/)
        .waitFor();
      expect(page.url()).toMatch(/backend=cpu/);
    });
  });

  test('begins with flood light, then a fire, unless the visitor chooses a light', async ({
    openPage,
  }) => {
    const page = await openPage('/', { fakeClock: true });
    const light = () => page.evaluate("document.getElementById('photo').activeLight");
    await waitUntilDrawn(page);
    expect(await light()).toBe('flood');
    await page.clock.runFor(6000);
    await expect.poll(light).toBe('fire');
    await expect(page.getByRole('radio', { name: 'Fire' })).toBeChecked();
    await page.goto('/');
    await waitUntilDrawn(page);
    await page.getByRole('radio', { name: 'Spectrum' }).check();
    await page.clock.runFor(6000);
    expect(await light()).toBe('spectrum');
  });

  test('uses the visitor’s image, video and camera as the light', async ({ openPage, step }) => {
    const page = await openPage('/?light=flood', {
      before: () => {
        const canvas = document.createElement('canvas');
        const stream = canvas.captureStream();
        Object.assign(globalThis, { stream });
        navigator.mediaDevices.getUserMedia = async () => stream;
      },
    });
    await waitUntilDrawn(page);

    await step('the image, until another light is chosen', async () => {
      const before = await brightnessOf(page);
      // White on the left, black on the right.
      const data = Uint8Array.from({ length: 40 }, (_, i) => (i % 4 === 3 || i < 20 ? 255 : 0));
      const buffer = encodePng({ width: 10, height: 1, data });
      const file = { name: 'half.png', mimeType: 'image/png', buffer };
      await page.getByLabel('an image or video').setInputFiles(file);
      await page.waitForFunction(() => document.querySelector('relightable-photo')?.light);
      expect(await page.getByRole('radio', { checked: true }).count()).toBe(0);
      await expect.poll(async () => (await brightnessOf(page)).x).toBeLessThan(before.x - 0.1);
      const half = await brightnessOf(page);
      await saveScreenshot(page, 'page-own-light.png');
      await page.getByRole('radio', { name: 'Flood' }).check();
      await expect.poll(async () => (await brightnessOf(page)).x).toBeGreaterThan(half.x + 0.1);
      const odd = { name: 'odd.png', mimeType: 'image/png', buffer: Buffer.from('nothing') };
      await page.getByLabel('an image or video').setInputFiles(odd);
      await page.getByRole('status').getByText('cannot show odd.png').waitFor();
    });

    await step('the video', async () => {
      const film = join(import.meta.dirname, '../fixtures/red-then-blue.webm');
      await page.getByLabel('an image or video').setInputFiles(film);
      await page.waitForFunction(
        () => document.querySelector('relightable-photo')?.light instanceof HTMLVideoElement,
      );
      const colour = async () => dominantColour(await screenPicture(page, '#photo'));
      await expect.poll(colour).toBe('red');
      await expect.poll(colour).toBe('blue');
    });

    await step('the camera, which stops afterwards', async () => {
      await page.getByRole('button', { name: 'your camera' }).click();
      await waitUntil(page, 'document.getElementById("photo").light === stream');
      const state = () => page.evaluate('stream.getVideoTracks()[0].readyState');
      expect(await state()).toBe('live');
      await page.getByRole('radio', { name: 'Stripes' }).check();
      expect(await state()).toBe('ended');
      expect(await page.evaluate("document.getElementById('photo').light")).toBeNull();
    });
  });

  test('its photographs fill their frames', async ({ openPage, step }) => {
    const page = await openPage('/?light=torch');
    await waitUntilDrawn(page);
    for (const width of [390, 1440]) {
      await page.setViewportSize({ width, height: 900 });
      await step(`at ${width} pixels`, async () => {
        const margins = await page.locator('.frame').evaluateAll((frames) =>
          frames.map((frame) => {
            const { paddingLeft, paddingRight } = getComputedStyle(frame);
            const padding = Number.parseFloat(paddingLeft) + Number.parseFloat(paddingRight);
            const photo = frame.querySelector('relightable-photo');
            return Math.round(frame.clientWidth - padding - (photo?.clientWidth ?? 0));
          }),
        );
        expect(margins).toStrictEqual([0, 0, 0, 0]);
      });
    }
  });
});
