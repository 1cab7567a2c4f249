/** The page "Recover" in every browser: a simulated object, and a capture as a zip file. */

import { expect, note } from './fixtures.js';

/** @typedef {import('./any-browser.js').AnyPage} AnyPage */

/** Longest recovery on a machine that compiles Rust meanwhile, in waits of the page. */
const MAX_WAITS = 4;

/** Declares the tests. @param {typeof import('./fixtures.js').test} test */
export function testRecoverPage(test) {
  test.describe('the page Recover', () => {
    test('recovers a simulated object, better from more patterns, and compares it', async ({
      openAnyPage,
    }) => {
      const page = await openAnyPage('/recover.html');
      await waitUntilReady(page);
      // The method that takes the least time.
      await page.evaluate("document.getElementById('method').value = 'nnls'");
      const few = await recoverSimulated(page, 20);
      const more = await recoverSimulated(page, 60);
      note(`SNR ${few} dB from 20 patterns, ${more} dB from 60`);
      expect(more).toBeGreaterThan(few + 3);
      for (const id of ['true-picture', 'recovered-picture', 'error-picture']) {
        await page.waitForFunction(isDrawn, id);
      }
    });

    test('recovers a zip file and shows it in the element', async ({ openAnyPage }) => {
      const page = await openAnyPage('/recover.html');
      await waitUntilReady(page);
      await page.evaluate(chooseZip);
      await waitUntilReady(page);
      await page.evaluate("document.getElementById('start').click()");
      await waitForText(page, '#facts', /SNR [\d.]+ dB on pictures that the recovery did not use/);
      await page.waitForFunction(
        () =>
          document.querySelector('relightable-photo')?.shadowRoot?.querySelector('canvas') != null,
      );
    });
  });
}

/** @param {AnyPage} page */
async function waitUntilReady(page) {
  await page.waitForFunction(() => {
    const start = /** @type {HTMLButtonElement | null} */ (document.getElementById('start'));
    return start?.disabled === false;
  });
}

/** Recovers a small object from so many patterns, and returns the SNR. @param {AnyPage} page @param {number} patterns */
async function recoverSimulated(page, patterns) {
  await page.evaluate((/** @type {number} */ patterns) => {
    const slider = /** @type {HTMLInputElement} */ (document.getElementById('patterns'));
    slider.value = String(patterns);
    for (const type of ['input', 'change'])
      slider.dispatchEvent(new Event(type, { bubbles: true }));
    const start = document.getElementById('start');
    // After the first recovery, the change starts the next.
    if (!document.getElementById('recover')?.hasAttribute('data-running')) start?.click();
  }, patterns);
  const said = await waitForText(
    page,
    '#announcement',
    new RegExp(`Recovered from ${patterns} patterns in [\\d.]+ s: SNR [\\d.]+ dB`),
  );
  return Number(/SNR ([\d.]+)/.exec(said)?.[1]);
}

/**
 * Waits until the text of an element matches, and returns it.
 *
 * @param {AnyPage} page
 * @param {string} selector
 * @param {RegExp} pattern
 * @returns {Promise<string>}
 */
async function waitForText(page, selector, pattern) {
  const read = () =>
    page.evaluate(
      (/** @type {string} */ selector) => document.querySelector(selector)?.textContent ?? '',
      selector,
    );
  for (let waits = 1; ; waits += 1) {
    try {
      await page.waitForFunction(
        (/** @type {{ selector: string, source: string }} */ { selector, source }) =>
          new RegExp(source).test(document.querySelector(selector)?.textContent ?? ''),
        { selector, source: pattern.source },
      );
      return await read();
    } catch (error) {
      if (waits === MAX_WAITS) throw new Error(`${selector}: "${await read()}"`, { cause: error });
    }
  }
}

/** Whether a canvas has bright and dark pixels. Runs in the page. @param {string} id */
function isDrawn(id) {
  const canvas = /** @type {HTMLCanvasElement} */ (document.getElementById(id));
  const { width, height } = canvas;
  const { data } = canvas.getContext('2d')?.getImageData(0, 0, width, height) ?? { data: [] };
  const red = [...data].filter((_, i) => i % 4 === 0);
  return width === 64 && Math.max(...red) > 100 && Math.min(...red) < 60;
}

/** Gives the page a zip file, as a visitor who chooses it. Runs in the page. */
async function chooseZip() {
  document.querySelector('#source input[value=own]')?.dispatchEvent(new MouseEvent('click'));
  const zip = await (await fetch('/glass-s.zip')).blob();
  const transfer = new DataTransfer();
  transfer.items.add(new File([zip], 'glass-s.zip', { type: 'application/zip' }));
  // The method that takes the least time.
  /** @type {HTMLSelectElement} */ (document.getElementById('own-method')).value = 'nnls';
  const input = /** @type {HTMLInputElement} */ (document.getElementById('zip'));
  input.files = transfer.files;
  input.dispatchEvent(new Event('change', { bubbles: true }));
}
