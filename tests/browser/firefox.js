/** Firefox, on a screen that nobody sees and with its GPU done in software, as shared tests want it. */

import puppeteer from 'puppeteer-core';
import { origin } from './browser.js';
import { openScreen } from './screen.js';

/** @typedef {import('./any-browser.js').AnyPage} AnyPage */

/** Firefox has WebGPU on Linux, but not on by default, and neither of the two with a software renderer. */
const PREFERENCES = {
  'dom.webgpu.enabled': true,
  'gfx.webgpu.ignore-blocklist': true,
  'webgl.force-enabled': true,
};

/**
 * @param {string} executablePath
 * @returns {Promise<{ name: string, close: () => Promise<void> } & import('./any-browser.js').AnyBrowser>}
 */
export async function launchFirefox(executablePath) {
  // Without a screen, even an unseen one, it has no WebGL.
  const screen = await openScreen();
  const browser = await puppeteer.launch({
    browser: 'firefox',
    executablePath,
    extraPrefsFirefox: PREFERENCES,
    env: { ...process.env, DISPLAY: screen.display },
  });
  return {
    name: await browser.version(),
    close: async () => {
      await browser.close();
      await screen.close();
    },
    open: async (test, path) => {
      const context = await browser.createBrowserContext();
      const page = await context.newPage();
      /** @type {string[]} */
      const faults = [];
      page.on('pageerror', (error) => faults.push(String(error)));
      page.on('console', (message) => {
        if (message.type() === 'error') faults.push(message.text());
      });
      test.after(async () => {
        const complaints = await page.evaluate('globalThis.complaints ?? []');
        faults.push(.../** @type {string[]} */ (complaints));
        await context.close();
        if (faults.length > 0) throw new Error(`the page complained:\n${faults.join('\n')}`);
      });
      await page.goto(origin + path);
      return likePlaywright(page);
    },
  };
}

/** @param {import('puppeteer-core').Page} page @returns {AnyPage} */
function likePlaywright(page) {
  const found = async (/** @type {string} */ selector) => {
    const element = await page.$(selector);
    if (!element) throw new Error(`there is no ${selector} on the page`);
    return element;
  };
  return /** @type {AnyPage} */ (
    /** @type {unknown} */ ({
      evaluate: (/** @type {any} */ work, /** @type {unknown} */ argument) =>
        page.evaluate(work, argument),
      waitForFunction: (/** @type {any} */ work, /** @type {unknown} */ argument) =>
        page.waitForFunction(work, { polling: 50 }, argument),
      mouse: page.mouse,
      keyboard: page.keyboard,
      locator: (/** @type {string} */ selector) => ({
        screenshot: async () => Buffer.from(await (await found(selector)).screenshot()),
      }),
    })
  );
}
