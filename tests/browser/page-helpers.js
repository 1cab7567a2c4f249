/** What tests do with a page: put an element into it, wait for its events, read its picture. */

import { join } from 'node:path';
import { expect } from '@playwright/test';
import { decodePng } from '../../www/tools/pictures.js';

/** @typedef {import('../../www/src/index.js').RelightablePhotoElement} RelightablePhotoElement */
/** @typedef {import('@playwright/test').Page} Page */
/** @typedef {import('./any-browser.js').AnyPage} AnyPage */
/** @typedef {{ type: string } & Record<string, unknown>} ElementEvent an event of the element, as data */

/**
 * Puts an element with these attributes into a page. The page's globals are then `photo`, the element, and
 * `photoEvents`, all its events as data.
 *
 * @param {AnyPage} page
 * @param {Record<string, string>} attributes
 */
export async function mountPhoto(page, attributes) {
  await page.evaluate(async (attributes) => {
    await customElements.whenDefined('relightable-photo');
    const photo = document.createElement('relightable-photo');
    /** @type {ElementEvent[]} */
    const photoEvents = [];
    const changes = ['lightchange', 'viewchange', 'backendchange', 'contextlost', 'qualitychange'];
    for (const type of ['load', 'progress', 'error', 'warning', ...changes]) {
      photo.addEventListener(type, (event) => {
        const fields = ['code', 'message', 'backend', 'previous', 'reason', 'light', 'torch'];
        const data = [...fields, 'loaded', 'total', 'quality', 'zoom', 'x', 'y']
          .filter((field) => field in event)
          .map((field) => [field, /** @type {any} */ (event)[field]]);
        photoEvents.push({ type, ...Object.fromEntries(data) });
      });
    }
    Object.assign(globalThis, { photo, photoEvents });
    for (const [name, value] of Object.entries(attributes)) photo.setAttribute(name, value);
    photo.style.width = '64px';
    (document.querySelector('main') ?? document.body).append(photo);
  }, attributes);
}

/**
 * Waits for an event of a type and returns all events since the element was mounted.
 *
 * @param {AnyPage} page
 * @param {string} type
 * @param {number} [count] how many events of the type to wait for
 * @returns {Promise<ElementEvent[]>}
 */
export async function waitForEvents(page, type, count = 1) {
  await page.waitForFunction(
    ([type, count]) => {
      const { photoEvents } = /** @type {any} */ (globalThis);
      return photoEvents.filter((/** @type {ElementEvent} */ e) => e.type === type).length >= count;
    },
    /** @type {const} */ ([type, count]),
  );
  return page.evaluate('photoEvents');
}

/**
 * Waits for `load` and returns all events since the element was mounted.
 *
 * @param {AnyPage} page
 * @throws if an `error` event comes first
 */
export async function waitForLoad(page) {
  await page.waitForFunction(() => {
    const { photoEvents } = /** @type {any} */ (globalThis);
    return photoEvents.some((/** @type {ElementEvent} */ { type }) => /^(load|error)$/.test(type));
  });
  /** @type {ElementEvent[]} */
  const photoEvents = await page.evaluate('photoEvents');
  const error = photoEvents.find((event) => event.type === 'error');
  if (error) throw new Error(`${error['code']}: ${error['message']}`);
  return photoEvents;
}

/**
 * Waits until an expression is true in the page. `page.waitForFunction` evaluates strings in the page itself, which its
 * Content Security Policy forbids.
 *
 * @param {AnyPage} page
 * @param {string} expression
 */
export function waitUntil(page, expression) {
  const options = { message: expression, intervals: [50] };
  return expect.poll(() => page.evaluate(expression), options).toBe(true);
}

/**
 * Opens a new page with an element, waits for `load` and returns all events.
 *
 * @param {Page} page
 * @param {Record<string, string>} attributes
 */
export async function loadPhoto(page, attributes) {
  await page.goto('/plain');
  await mountPhoto(page, attributes);
  return waitForLoad(page);
}

/**
 * Counts the events of a type since the element was mounted.
 *
 * @param {AnyPage} page
 * @param {string} type
 */
export async function countEvents(page, type) {
  /** @type {ElementEvent[]} */
  const events = await page.evaluate('photoEvents');
  return events.filter((event) => event.type === type).length;
}

/**
 * Sets attributes of the page's first element, and returns its picture in full quality.
 *
 * @param {AnyPage} page
 * @param {Record<string, string>} [attributes]
 * @param {{ x: number, y: number } | null} [torch]
 */
export async function capturePicture(page, attributes = {}, torch) {
  const url = await page.evaluate(
    async ({ attributes, torch }) => {
      const photo = /** @type {RelightablePhotoElement} */ (
        document.querySelector('relightable-photo')
      );
      for (const [name, value] of Object.entries(attributes)) photo.setAttribute(name, value);
      if (torch !== undefined) photo.torch = torch;
      const blob = await photo.toBlob();
      const reader = new FileReader();
      reader.readAsDataURL(blob);
      await new Promise((resolve) => reader.addEventListener('load', resolve));
      return String(reader.result);
    },
    { attributes, torch },
  );
  return decodeDataUrl(url);
}

/** @param {string} url of a PNG file */
export function decodeDataUrl(url) {
  return decodePng(Buffer.from(url.slice(url.indexOf(',') + 1), 'base64'));
}

/**
 * The element's pixels on the screen.
 *
 * @param {AnyPage} page
 * @param {string} [selector]
 */
export async function screenPicture(page, selector = 'relightable-photo') {
  // To hide the caret, Playwright would set inline styles, which strict policies refuse.
  return decodePng(await page.locator(selector).screenshot({ caret: 'initial' }));
}

const SCREENSHOTS = join(import.meta.dirname, '../../target/screenshots');

/**
 * Writes a picture for people to look at to target/screenshots, if the environment has `SCREENSHOTS`. No test reads it,
 * and a long page takes a second.
 *
 * @param {Page | import('@playwright/test').Locator} subject
 * @param {string} name of the file
 */
export async function saveScreenshot(subject, name) {
  if (!process.env['SCREENSHOTS']) return;
  await subject.screenshot({
    path: join(SCREENSHOTS, name),
    ...('goto' in subject && { fullPage: true }),
  });
}

/**
 * Waits for frames. A test that counts frames proves that nothing happens meanwhile, however slow the machine is.
 *
 * @param {AnyPage} page
 * @param {number} [count]
 */
export async function waitForFrames(page, count = 12) {
  await page.evaluate(async (count) => {
    for (let i = 0; i < count; i += 1) await new Promise(requestAnimationFrame);
  }, count);
}

/** The rules of axe-core that a page violates, with the HTML of the elements. @param {Page} page */
export async function axeViolations(page) {
  // What the rules found right, thousands of elements on a long page, is neither described nor sent here.
  const run = "axe.run({ resultTypes: ['violations'] }).then(({ violations }) => violations)";
  const violations = /** @type {any[]} */ (await page.evaluate(run));
  return violations.map(
    ({ id, nodes }) => `${id}: ${nodes.map((/** @type {any} */ node) => node.html).join(' ')}`,
  );
}

/** By how many pixels a page is wider than its viewport. @param {Page} page @returns {Promise<number>} */
export function horizontalOverflow(page) {
  return page.evaluate(
    'document.documentElement.scrollWidth - document.documentElement.clientWidth',
  );
}

/**
 * Drags with the mouse, in one movement.
 *
 * @param {AnyPage} page
 * @param {{ x: number, y: number }} from
 * @param {{ x: number, y: number }} to
 * @param {'left' | 'middle'} [button]
 */
export async function drag(page, from, to, button = 'left') {
  await page.mouse.move(from.x, from.y);
  await page.mouse.down({ button });
  await page.mouse.move(to.x, to.y);
  await page.mouse.up({ button });
}

/** At most how long the element pauses after a request that failed. */
const LONGEST_PAUSE_MS = 8000;
/** How long a test waits for an event, on a machine that compiles Rust meanwhile. */
const LONGEST_WAIT_MS = 60_000;

/**
 * Waits for an event of a type, and ends the element's pauses early. The page needs a fake clock. While a request is
 * in progress the clock runs as usual, lest the element takes it for stalled.
 *
 * @param {Page} page
 * @param {string} type
 * @param {() => Promise<unknown>} start what leads to the event
 */
export async function skipPausesUntil(page, type, start) {
  const requests = new Set();
  const add = (/** @type {import('@playwright/test').Request} */ request) => requests.add(request);
  const remove = (/** @type {import('@playwright/test').Request} */ request) =>
    requests.delete(request);
  page.on('request', add).on('requestfinished', remove).on('requestfailed', remove);
  await start();
  const deadline = Date.now() + LONGEST_WAIT_MS;
  while ((await countEvents(page, type)) === 0) {
    if (Date.now() > deadline) throw new Error(`the element reported no ${type}`);
    if (requests.size === 0) await page.clock.fastForward(LONGEST_PAUSE_MS);
    // A request that begins is reported meanwhile.
    await waitForFrames(page, 3);
  }
  page.off('request', add).off('requestfinished', remove).off('requestfailed', remove);
}

/**
 * Waits for a `warning` event and returns its data. A warning shows nothing on the picture.
 *
 * @param {Page} page
 * @param {number} [count] how many warnings to wait for
 */
export async function waitForWarning(page, count = 1) {
  const events = await waitForEvents(page, 'warning', count);
  await alertOf(page).waitFor({ state: 'hidden' });
  expect(events.some(({ type }) => type === 'error')).toBe(false);
  return /** @type {ElementEvent} */ (events.findLast(({ type }) => type === 'warning'));
}

/** The element's error message. @param {Page} page */
export function alertOf(page) {
  return page.getByRole('alert');
}

/**
 * Opens the details of the element's error message, which begins with one short sentence.
 *
 * @param {Page} page
 */
export async function openAlertDetails(page) {
  await alertOf(page)
    .getByText(/cannot be shown/)
    .waitFor({ state: 'visible' });
  const details = page.locator('relightable-photo details');
  await details.evaluate((element) => element.setAttribute('open', ''));
  return alertOf(page);
}

/** Removes WebGPU and WebGL2 from a page. For `before` of `openPage`. */
export function removeGraphics() {
  Object.defineProperty(Navigator.prototype, 'gpu', { get: () => undefined });
  const { getContext } = HTMLCanvasElement.prototype;
  HTMLCanvasElement.prototype.getContext = /** @type {any} */ (
    /** @this {HTMLCanvasElement} @param {string} kind @param {any[]} rest */
    function (kind, ...rest) {
      return kind === 'webgl2' ? null : Reflect.apply(getContext, this, [kind, ...rest]);
    }
  );
}

/** The place of an element that is displayed. @param {import('@playwright/test').Locator} locator */
export async function boxOf(locator) {
  const box = await locator.boundingBox();
  if (!box) throw new Error(`${locator} is not displayed`);
  return box;
}

/**
 * Makes a function that converts picture coordinates, from 0 to 1, to a point on the page.
 *
 * @param {AnyPage} page
 */
export async function pointOf(page) {
  const { left, top, width, height } = await page.evaluate(
    "document.querySelector('relightable-photo').getBoundingClientRect().toJSON()",
  );
  return (/** @type {number} */ x, /** @type {number} */ y) => ({
    x: left + x * width,
    y: top + y * height,
  });
}

/**
 * Which of red and blue dominates a picture.
 *
 * @param {import('../../www/tools/pictures.js').Picture} picture
 * @returns {'red' | 'blue' | 'neither'}
 */
export function dominantColour({ data }) {
  let [red, blue] = [0, 0];
  for (let at = 0; at < data.length; at += 4) {
    red += data[at] ?? 0;
    blue += data[at + 2] ?? 0;
  }
  return red > 2 * blue ? 'red' : blue > 2 * red ? 'blue' : 'neither';
}
