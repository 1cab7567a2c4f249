/** Loads a built page in a browser under the documented content security policy. */

import { after } from 'node:test';
import sirv from 'sirv';
import { launchChromium } from '../../www/tools/chromium.js';
import { decodePng } from '../../www/tools/pictures.js';
import { answer } from '../../www/tools/ranges.js';
import { listen } from '../../www/tools/serve.js';
import { glassBytes } from '../browser/test-photos.js';

/** The documented policy. @param {string} scripts further sources of scripts */
const policy = (scripts) =>
  `default-src 'none'; script-src 'self' 'wasm-unsafe-eval'${scripts}; style-src 'self'; img-src 'self'; connect-src 'self'`;

/** Generous, as test machines may be busy. */
const PATIENCE_MS = 120_000;

const browser = await launchChromium();
after(() => browser.close());

/** @typedef {import('../../www/src/index.js').RelightablePhotoElement} RelightablePhotoElement */

/**
 * @typedef {object} Visit
 * @property {import('../../www/tools/pictures.js').Picture} picture under its first light
 * @property {Record<string, unknown>} state of the element, by its properties
 * @property {string[]} workers addresses
 * @property {string[]} requests addresses
 * @property {string[]} complaints console errors, exceptions and policy violations of the page
 * @property {string} origin
 */

/**
 * Serves folders of a built site, opens its first page and waits until the photograph is drawn.
 *
 * @param {{ at: string, folder: string }[]} mounts
 * @param {Record<string, string>} [attributes] set after that; the picture is awaited again
 * @param {string} [scripts] further sources of scripts in the policy, for a tool's inline scripts
 * @returns {Promise<Visit>}
 */
export async function visit(mounts, attributes = {}, scripts = '') {
  const server = await listen(serve(mounts, policy(scripts)), 0);
  const context = await browser.newContext();
  try {
    const page = await context.newPage();
    page.setDefaultTimeout(PATIENCE_MS);
    /** @type {{ workers: string[], requests: string[], complaints: string[] }} */
    const { workers, requests, complaints } = { workers: [], requests: [], complaints: [] };
    page.on('worker', (worker) => workers.push(worker.url()));
    page.on('request', (request) => requests.push(request.url()));
    page.on('pageerror', (error) => complaints.push(String(error)));
    page.on('console', (message) => {
      if (['error', 'warning'].includes(message.type())) complaints.push(message.text());
    });
    page.on('response', (response) => {
      if (response.status() >= 400) complaints.push(`${response.status()} for ${response.url()}`);
    });
    await page.exposeFunction('refused', (/** @type {string} */ what) => complaints.push(what));
    await page.addInitScript(() => {
      const state = { loads: 0, error: '' };
      Object.assign(globalThis, { state });
      // The events do not bubble. Scripts have such events as well.
      const isPhoto = (/** @type {Event} */ { target }) =>
        target instanceof Element && target.localName === 'relightable-photo';
      const onLoad = (/** @type {Event} */ event) => {
        if (isPhoto(event)) state.loads += 1;
      };
      const onError = (/** @type {Event} */ event) => {
        if (isPhoto(event)) state.error ||= Object(event).message ?? String(event);
      };
      document.addEventListener('load', onLoad, { capture: true });
      document.addEventListener('error', onError, { capture: true });
      document.addEventListener('securitypolicyviolation', ({ violatedDirective, blockedURI }) => {
        Object(globalThis).refused(`${violatedDirective} refused ${blockedURI}`);
      });
    });
    await page.goto(server.url);
    const drawn = page.waitForFunction(() => {
      const { loads, error } = Object(globalThis).state;
      return loads > 0 || error;
    });
    await drawn.catch((cause) => {
      const seen = JSON.stringify({ complaints, workers, requests }, null, 2);
      throw new Error(`The page shows no photograph: ${seen}`, { cause });
    });
    const url = await page.evaluate(async (attributes) => {
      const photo = /** @type {RelightablePhotoElement} */ (
        document.querySelector('relightable-photo')
      );
      for (const [name, value] of Object.entries(attributes)) {
        const changed = new Promise((resolve) => photo.addEventListener(`${name}change`, resolve));
        photo.setAttribute(name, value);
        await changed;
      }
      const blob = await photo.toBlob();
      const reader = new FileReader();
      reader.readAsDataURL(blob);
      await new Promise((resolve) => reader.addEventListener('load', resolve));
      return String(reader.result);
    }, attributes);
    const state = await page.evaluate(() => {
      const photo = /** @type {RelightablePhotoElement} */ (
        document.querySelector('relightable-photo')
      );
      const { activeBackend, kernel, shadowRoot } = photo;
      const inside = [...(shadowRoot?.querySelectorAll('*') ?? [])];
      const parts = inside.flatMap(({ part }) => [...part]);
      const slots = inside
        .filter((slot) => slot instanceof HTMLSlotElement)
        .map(({ name }) => name);
      const output = document.querySelector('output')?.textContent;
      return { ...Object(globalThis).state, activeBackend, kernel, parts, slots, output };
    });
    const picture = decodePng(Buffer.from(url.slice(url.indexOf(',') + 1), 'base64'));
    return { picture, state, workers, requests, complaints, origin: new URL(server.url).origin };
  } finally {
    await context.close();
    await server.close();
  }
}

/**
 * Opens a page that the guide's component `Window` renders: shows a photograph, and lights a fire.
 *
 * @param {{ at: string, folder: string }[]} mounts
 * @param {string} path of the page; the address of its photograph may be wrong
 * @param {string} [scripts] as of `visit`
 * @returns {Promise<{ message: string, faults: string[] }>} the caption, and the page's exceptions and policy
 *   violations
 */
export async function useWindow(mounts, path, scripts = '') {
  const server = await listen(serve(mounts, policy(scripts)), 0);
  const context = await browser.newContext();
  try {
    const page = await context.newPage();
    page.setDefaultTimeout(PATIENCE_MS);
    /** @type {string[]} */
    const faults = [];
    page.on('pageerror', (error) => faults.push(String(error)));
    page.on('console', (message) => {
      if (/hydrat|policy|Vue warn/i.test(message.text())) faults.push(message.text());
    });
    await page.goto(new URL(path, server.url).href);
    await page.waitForFunction(() => {
      const photo = /** @type {RelightablePhotoElement} */ (
        document.querySelector('relightable-photo')
      );
      return photo.activeBackend || document.querySelector('figcaption');
    });
    await page.getByRole('button', { name: 'Light a fire' }).click();
    await page.waitForFunction(
      () => document.querySelector('relightable-photo')?.activeLight === 'fire',
    );
    const captions = await page.locator('figcaption').allInnerTexts();
    return { message: captions.join(), faults };
  } finally {
    await context.close();
    await server.close();
  }
}

/**
 * Opens a page that reports pixels in its title: width, height and RGBA, separated by commas.
 *
 * @param {{ at: string, folder: string }[]} mounts
 */
export async function draw(mounts) {
  const server = await listen(serve(mounts, policy('')), 0);
  const page = await browser.newPage();
  page.setDefaultTimeout(PATIENCE_MS);
  try {
    /** @type {string[]} */
    const complaints = [];
    page.on('pageerror', (error) => complaints.push(String(error)));
    page.on('console', (message) => complaints.push(message.text()));
    await page.goto(server.url);
    await page.waitForFunction(() => document.title !== '');
    const title = await page.title();
    const [width = 0, height = 0, ...data] = title.split(',').map(Number);
    if (data.length === 0) complaints.push(title);
    return { picture: { width, height, data: Uint8Array.from(data) }, complaints };
  } finally {
    await page.close();
    await server.close();
  }
}

/**
 * @param {{ at: string, folder: string }[]} mounts
 * @param {string} policy
 * @returns {import('node:http').RequestListener}
 */
function serve(mounts, policy) {
  const handlers = mounts.map(({ at, folder }) => ({ at, handle: sirv(folder, { dev: true }) }));
  return (request, response) => {
    response.setHeader('Content-Security-Policy', policy);
    const url = request.url ?? '/';
    if (url === '/favicon.ico') {
      response.writeHead(204).end();
      return;
    }
    if (url === '/photos/glass.ltm') {
      const read = (/** @type {number} */ start, /** @type {number} */ end) => [
        glassBytes().subarray(start, end),
      ];
      const content = { size: glassBytes().length, type: 'application/vnd.ltm', etag: '"a"', read };
      answer(request, response, content).catch(() => {});
      return;
    }
    const mount = handlers.find(({ at }) => url.startsWith(at));
    request.url = url.slice((mount?.at.length ?? 1) - 1);
    const missing = () => void response.writeHead(404).end();
    if (mount) mount.handle(request, response, missing);
    else missing();
  };
}
