/** One Chromium and one server, shared by all measurements. */

import { readFile } from 'node:fs/promises';
import { join } from 'node:path';
import { launchChromium } from '../../www/tools/chromium.js';
import { listen } from '../../www/tools/serve.js';
import { site } from '../../www/tools/site.js';

/** @typedef {{ frames: typeof import('./frames.js'), hooks: typeof import('./hooks.js'), peers: typeof import('./peers.js'), copying: typeof import('./copying.js') }} Modules */

const HTML = `<!doctype html><html lang="en"><title>Bench</title>
<script type="module" src="/bench/hooks.js"></script>
<script type="module" src="/relightable-photo/relightable-photo.js"></script>`;
/** Cross-origin isolated pages have a clock of 5 microseconds. */
const ISOLATED = {
  'Cross-Origin-Opener-Policy': 'same-origin',
  'Cross-Origin-Embedder-Policy': 'require-corp',
};

/** Makes relighting workers record their modules' memory, which is otherwise out of reach. */
const RELIGHTER = '/relightable-photo/relightable-photo-relighter.js';
const NOTING = `
  const memories = (globalThis.memories = []);
  for (const name of ['instantiate', 'instantiateStreaming']) {
    const make = WebAssembly[name];
    WebAssembly[name] = async (...given) => {
      const made = await make.apply(WebAssembly, given);
      memories.push((made.instance ?? made).exports.memory);
      return made;
    };
  }
`;

/** @type {string} */
let origin;
/** @type {import('playwright-core').Browser} */
let browser;

/**
 * Serves a folder of photographs and starts the browser.
 *
 * @param {string} photos
 * @returns {Promise<() => Promise<void>>} stops both
 */
export async function start(photos) {
  const serveSite = site({ photos });
  const server = await listen(async (request, response) => {
    for (const [name, value] of Object.entries(ISOLATED)) response.setHeader(name, value);
    const [path = ''] = (request.url ?? '').split('?');
    const script = /^\/bench\/([a-z-]+\.js)$/.exec(path)?.[1];
    if (path === '/bench') response.setHeader('Content-Type', 'text/html').end(HTML);
    else if (script) {
      response.setHeader('Content-Type', 'text/javascript');
      response.end(await readFile(join(import.meta.dirname, script)));
    } else if (path === RELIGHTER) {
      const script = join(import.meta.dirname, '../../dist/relightable-photo-relighter.js');
      response.setHeader('Content-Type', 'text/javascript');
      response.end(NOTING + (await readFile(script, 'utf8')));
    } else serveSite(request, response);
  }, 0);
  origin = server.url;
  browser = await launchChromium();
  return async () => {
    await browser.close();
    await server.close();
  };
}

export const browserVersion = () => browser.version();

/**
 * Opens a page in a context of its own; the caller closes the context. With `workers`, the page sees so many cores.
 *
 * @param {{ workers?: number }} options
 */
export async function openPage({ workers }) {
  const context = await browser.newContext();
  const page = await context.newPage();
  page.setDefaultTimeout(0);
  page.on('pageerror', (error) => console.error(`page: ${error}`));
  await page.goto(`${origin}bench${workers ? `?workers=${workers}` : ''}`);
  return page;
}

/** Tells whether an adapter is a software renderer. @param {string} adapter */
export const isSoftware = (adapter) => /swiftshader|llvmpipe|basic render/i.test(adapter);

/**
 * Runs a function in a page and passes it this folder's modules for pages.
 *
 * @template A, R
 * @param {import('playwright-core').Page} page
 * @param {(modules: Modules, argument: A) => Promise<R>} work
 * @param {A} [argument]
 * @returns {Promise<R>}
 */
export async function inPage(page, work, argument) {
  const text = `(async () => {
    const names = ['frames', 'hooks', 'peers', 'copying'];
    const all = await Promise.all(names.map((name) => import('/bench/' + name + '.js')));
    const modules = Object.fromEntries(names.map((name, i) => [name, all[i]]));
    return (${work})(modules, ${JSON.stringify(argument) ?? 'undefined'});
  })()`;
  return /** @type {R} */ (await page.evaluate(text));
}
