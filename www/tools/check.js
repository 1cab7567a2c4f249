/**
 * Compares every light that the demo page draws in Chromium with ltm-export: node www/tools/check.js PHOTO.ltm
 * Exits with 1 when a picture differs or the page reports an error.
 */

import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join, resolve } from 'node:path';
import { launchChromium } from './chromium.js';
import { compare, decodePng } from './pictures.js';
import { listen } from './serve.js';
import { site } from './site.js';

/** Rounding may change a code, out of 255, by 1. */
const MAX_DIFFERENCE = 1;
const LIGHTS = ['flood', 'torch', 'checkerboard', 'stripes', 'spectrum', 'fire'];

const photo = resolve(process.argv[2] ?? 'target/demo/photos/stained-glass.ltm');
const program = join(import.meta.dirname, '../../target/release/ltm-export');
const scratch = mkdtempSync(join(tmpdir(), 'relightable-photo-'));
const server = await listen(site({ photos: dirname(photo) }), 0);
const browser = await launchChromium();
try {
  const faults = await check();
  for (const fault of faults) console.error(`check: ${fault}`);
  if (faults.length === 0) {
    console.log(
      `check: the page agrees with ltm-export under every light, to ${MAX_DIFFERENCE}/255`,
    );
  }
  process.exitCode = faults.length > 0 ? 1 : 0;
} finally {
  await browser.close();
  await server.close();
  rmSync(scratch, { recursive: true });
}

/** @returns {Promise<string[]>} descriptions of the faults */
async function check() {
  /** @type {string[]} */
  const faults = [];
  // Under reduced motion, fire rests at its first frame, as in ltm-export.
  const page = await browser.newPage({ reducedMotion: 'reduce' });
  page.on('pageerror', (error) => faults.push(`the page threw ${error}`));
  page.on('console', (message) => {
    if (message.type() === 'error') faults.push(`the page logged an error: ${message.text()}`);
  });
  await page.goto(server.url);
  // Either the whole photograph is drawn, or an error is shown.
  await page.waitForFunction(() => {
    const element = document.querySelector('relightable-photo');
    const alert = element?.shadowRoot?.querySelector('[role=alert]');
    return element?.quality === 1 || alert?.checkVisibility();
  });
  const alert = page.locator('relightable-photo').first().getByRole('alert');
  if (await alert.isVisible()) return [...faults, await alert.innerText()];
  const backend = await page.evaluate(() => {
    const { activeBackend, kernel } = /** @type {any} */ (
      document.querySelector('relightable-photo')
    );
    return `${activeBackend} (${kernel})`;
  });
  console.log(`backend: ${backend}`);
  for (const light of LIGHTS) {
    const { worst, psnr } = compare(await pagePicture(page, light), nativePicture(light));
    console.log(`${light.padEnd(12)} PSNR ${psnr.toFixed(2)} dB, worst difference ${worst}/255`);
    if (!(worst <= MAX_DIFFERENCE))
      faults.push(`${light} differs by ${worst}/255 from ltm-export relight`);
  }
  return faults;
}

/** @param {import('playwright-core').Page} page @param {string} light */
async function pagePicture(page, light) {
  const url = await page.evaluate(async (light) => {
    const element = /** @type {import('../src/index.js').RelightablePhotoElement} */ (
      document.querySelector('relightable-photo')
    );
    element.setAttribute('light', light);
    const blob = await element.toBlob();
    const reader = new FileReader();
    reader.readAsDataURL(blob);
    await new Promise((done) => reader.addEventListener('load', done));
    return String(reader.result);
  }, light);
  return decodePng(Buffer.from(url.slice(url.indexOf(',') + 1), 'base64'));
}

/** @param {string} light */
function nativePicture(light) {
  const out = join(scratch, `${light}.png`);
  execFileSync(program, ['relight', photo, '--light', light, '-o', out], {
    stdio: ['ignore', 'ignore', 'inherit'],
  });
  return decodePng(readFileSync(out));
}
