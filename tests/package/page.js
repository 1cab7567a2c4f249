/** Loads a built page in a browser, under the policy that the element is made for. */

import { after } from 'node:test';
import sirv from 'sirv';
import { launchChromium } from '../../www/tools/chromium.js';
import { decodePng } from '../../www/tools/pictures.js';
import { answer } from '../../www/tools/ranges.js';
import { listen } from '../../www/tools/serve.js';
import { glassBytes } from '../browser/photos.js';

export const CONTENT_SECURITY_POLICY =
  "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self'; connect-src 'self'";

const browser = await launchChromium();
after(() => browser.close());

/** @typedef {import('../../www/src/index.js').RelightablePhoto} RelightablePhoto */

/**
 * @typedef {object} Visit
 * @property {import('../../www/tools/pictures.js').Picture} picture under its first light
 * @property {Record<string, unknown>} state of the element, by its properties
 * @property {string[]} workers addresses
 * @property {string[]} requests addresses
 * @property {string[]} complaints of the page: what it logged as errors, threw, or was refused
 * @property {string} origin
 */

/**
 * Serves folders of a built site, opens its first page and waits until the photograph is drawn.
 *
 * @param {{ at: string, folder: string }[]} mounts
 * @param {Record<string, string>} [attributes] to set then, and to wait for what they change to
 * @returns {Promise<Visit>}
 */
export async function visit(mounts, attributes = {}) {
  const server = await listen(serve(mounts), 0);
  const context = await browser.newContext();
  try {
    const page = await context.newPage();
    /** @type {string[]} */
    const [workers, requests, complaints] = [[], [], /** @type {string[]} */ ([])];
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
      document.addEventListener('load', ({ target }) => {
        if (target instanceof Element && target.localName === 'relightable-photo') state.loads += 1;
      });
      document.addEventListener('error', (event) => {
        state.error ||= Object(event).message ?? String(event);
      });
      document.addEventListener('securitypolicyviolation', ({ violatedDirective, blockedURI }) => {
        Object(globalThis).refused(`${violatedDirective} refused ${blockedURI}`);
      });
    });
    await page.goto(server.url);
    await page.waitForFunction(() => {
      const { loads, error } = Object(globalThis).state;
      return loads > 0 || error;
    });
    const url = await page.evaluate(async (attributes) => {
      const photo = /** @type {RelightablePhoto} */ (document.querySelector('relightable-photo'));
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
      const photo = /** @type {RelightablePhoto} */ (document.querySelector('relightable-photo'));
      const { activeBackend, kernel } = photo;
      return { ...Object(globalThis).state, activeBackend, kernel };
    });
    const picture = decodePng(Buffer.from(url.slice(url.indexOf(',') + 1), 'base64'));
    return { picture, state, workers, requests, complaints, origin: new URL(server.url).origin };
  } finally {
    await context.close();
    await server.close();
  }
}

/**
 * @param {{ at: string, folder: string }[]} mounts
 * @returns {import('node:http').RequestListener}
 */
function serve(mounts) {
  const handlers = mounts.map(({ at, folder }) => ({ at, handle: sirv(folder, { dev: true }) }));
  return (request, response) => {
    response.setHeader('Content-Security-Policy', CONTENT_SECURITY_POLICY);
    const url = request.url ?? '/';
    if (url === '/favicon.ico') {
      response.writeHead(204).end();
      return;
    }
    if (url === '/photos/glass.ltm') {
      const read = (/** @type {number} */ start, /** @type {number} */ end) => [
        glassBytes.subarray(start, end),
      ];
      const content = { size: glassBytes.length, type: 'application/vnd.ltm', etag: '"a"', read };
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
