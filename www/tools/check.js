/**
 * Loads the demo page in a headless browser and holds every light it shows against the native
 * program: node www/tools/check.js PHOTO.ltm. Exits with 1 if anything is off.
 */

import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join, resolve } from 'node:path';
import { launchChromium } from './chromium.js';
import { compare, decodePng } from './pictures.js';
import { listen } from './serve.js';
import { site } from './site.js';

/** Largest difference of a code that rounding explains. */
const TOLERANCE = 1;
const LIGHTS = ['flood', 'torch', 'checkerboard', 'stripes', 'spectrum', 'fire'];

const photo = resolve(process.argv[2] ?? 'target/demo/photos/stained-glass.ltm');
const program = join(import.meta.dirname, '../../target/release/ltm-export');
const scratch = mkdtempSync(join(tmpdir(), 'relightable-photo-'));
const server = await listen(site({ photos: dirname(photo) }), 0);
const browser = await launchChromium();
try {
  const wrong = await check();
  for (const complaint of wrong) console.error(`check: ${complaint}`);
  if (wrong.length === 0) {
    console.log(`check: the page draws every light as ltm-export does, to ${TOLERANCE}/255`);
  }
  process.exitCode = wrong.length > 0 ? 1 : 0;
} finally {
  await browser.close();
  await server.close();
  rmSync(scratch, { recursive: true });
}

/** @returns {Promise<string[]>} what is wrong */
async function check() {
  /** @type {string[]} */
  const wrong = [];
  // Fire stands still at its first moment.
  const page = await browser.newPage({ reducedMotion: 'reduce' });
  page.on('pageerror', (error) => wrong.push(`the page threw ${error}`));
  page.on('console', (message) => {
    if (message.type() === 'error') wrong.push(`the page complained: ${message.text()}`);
  });
  await page.goto(server.url);
  // Either the whole picture or the reason why there is none.
  await page.waitForFunction(() => {
    const element = document.querySelector('relightable-photo');
    const alert = element?.shadowRoot?.querySelector('[role=alert]');
    return element?.detail === 1 || alert?.checkVisibility();
  });
  const alert = page.locator('relightable-photo').first().getByRole('alert');
  if (await alert.isVisible()) return [...wrong, await alert.innerText()];
  const backend = await page.evaluate(() => {
    const { activeBackend, kernel } = /** @type {any} */ (
      document.querySelector('relightable-photo')
    );
    return `${activeBackend} (${kernel})`;
  });
  console.log(`back end: ${backend}`);
  for (const light of LIGHTS) {
    const { worst, psnr } = compare(await drawn(page, light), native(light));
    console.log(`${light.padEnd(12)} PSNR ${psnr.toFixed(2)} dB, worst difference ${worst}/255`);
    if (!(worst <= TOLERANCE))
      wrong.push(`${light} differs by ${worst}/255 from ltm-export relight`);
  }
  return wrong;
}

/** @param {import('playwright-core').Page} page @param {string} light */
async function drawn(page, light) {
  const url = await page.evaluate(async (light) => {
    const element = /** @type {import('../src/index.js').RelightablePhoto} */ (
      document.querySelector('relightable-photo')
    );
    element.light = light;
    const blob = await element.toBlob();
    const reader = new FileReader();
    reader.readAsDataURL(blob);
    await new Promise((done) => reader.addEventListener('load', done));
    return String(reader.result);
  }, light);
  return decodePng(Buffer.from(url.slice(url.indexOf(',') + 1), 'base64'));
}

/** @param {string} light */
function native(light) {
  const out = join(scratch, `${light}.png`);
  execFileSync(program, ['relight', photo, '--light', light, '-o', out], {
    stdio: ['ignore', 'ignore', 'inherit'],
  });
  return decodePng(readFileSync(out));
}
