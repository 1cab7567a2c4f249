/** One server for all tests, one Chromium for those that open pages in it, and what tests do with them. */

import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { after } from 'node:test';
import { gzipSync } from 'node:zlib';
import axe from 'axe-core';
import { launchChromium } from '../../www/tools/chromium.js';
import { decodePng, encodePng } from '../../www/tools/pictures.js';
import { answer } from '../../www/tools/ranges.js';
import { listen } from '../../www/tools/serve.js';
import { CONTENT_SECURITY_POLICY, site } from '../../www/tools/site.js';
import { FOLDER, glassBytes } from './photos.js';
import { watch } from './watch.js';

/** @typedef {import('../../www/src/index.js').RelightablePhoto} RelightablePhoto */
/** @typedef {import('playwright-core').Page} Page */
/** @typedef {import('./any-browser.js').AnyPage} AnyPage */
/** @typedef {{ type: string } & Record<string, unknown>} Happening an event, as data */
/** @typedef {import('node:http').ServerResponse} Response */
/** @typedef {import('node:http').IncomingMessage} Request */

/** What elements ask for first. */
export const FIRST_BYTES = 1 << 14;

/** What the element is made to live under, with films of the page's own. */
const STRICTEST =
  "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self'; " +
  "connect-src 'self'; media-src 'self'";
const WATCH = `(${watch})()`;
const FILM = readFileSync(join(import.meta.dirname, '../fixtures/red-then-blue.webm'));

const SLOW_PIECES = 40;
const UNTIL_MS = 10_000;

/**
 * A server that compresses, and lets pages of other origins read what it sends.
 *
 * @param {number} level
 * @returns {(response: Response) => unknown}
 */
function gzipped(level) {
  const bytes = gzipSync(glassBytes, { level });
  return (response) =>
    response
      .writeHead(200, {
        'Access-Control-Allow-Origin': '*',
        'Content-Encoding': 'gzip',
        'Content-Length': bytes.length,
      })
      .end(bytes);
}

/**
 * Answers as servers do that know ranges.
 *
 * @param {Response} response
 * @param {Request} request
 * @param {{ etag?: string, bytes?: Buffer }} [file]
 */
function inParts(response, request, { etag = '"a"', bytes = glassBytes } = {}) {
  const read = (/** @type {number} */ start, /** @type {number} */ end) => [
    bytes.subarray(start, end),
  ];
  const content = { size: bytes.length, type: 'application/vnd.ltm', etag, read };
  answer(request, response, content).catch(() => {});
}

/** White on the left, black on the right. */
const HALF = encodePng({
  width: 10,
  height: 10,
  data: Uint8Array.from({ length: 400 }, (_, i) => (i % 4 === 3 || i % 40 < 20 ? 255 : 0)),
});

/**
 * Bad servers and odd ones, by path. `count` is 1 with the first request for an address.
 *
 * @type {Record<string, (response: Response, request: Request, count: number) => unknown>}
 */
const FAULTS = {
  '/faults/status': (response) => response.writeHead(503, 'Service Unavailable').end('later'),
  '/faults/html': (response) =>
    response.writeHead(200, { 'Content-Type': 'text/html' }).end('<h1>Please log in</h1>'),
  // Says more than it sends, and closes.
  '/faults/short': (response) => {
    response.writeHead(200, { 'Content-Length': glassBytes.length });
    response.write(glassBytes.subarray(0, glassBytes.length / 2), () => response.destroy());
  },
  // Chunked, so without a length, and cut in the middle.
  '/faults/cut': (response) => {
    response.writeHead(200);
    response.write(glassBytes.subarray(0, glassBytes.length / 2), () => response.destroy());
  },
  // Without a length and without chunks, as HTTP/1.0 had it: a cut looks like an end.
  '/faults/cut-silently': (response) => {
    response.useChunkedEncodingByDefault = false;
    response.shouldKeepAlive = false;
    response.writeHead(200, { Connection: 'close' });
    response.end(glassBytes.subarray(0, glassBytes.length / 2));
  },
  '/faults/no-answer': (response) => response.destroy(),
  // Whole, but so slowly that tests can do things meanwhile.
  '/faults/slow': async (response) => {
    response.writeHead(200, { 'Content-Length': glassBytes.length });
    const piece = Math.ceil(glassBytes.length / SLOW_PIECES);
    for (let at = 0; at < glassBytes.length && !response.destroyed; at += piece) {
      response.write(glassBytes.subarray(at, at + piece));
      await new Promise((resolve) => setTimeout(resolve, 50));
    }
    response.end();
  },
  '/faults/gzipped': gzipped(9),
  // Longer than the file itself.
  '/faults/gzipped-longer': gzipped(0),
  // Readable by pages of other origins, to which Content-Range, ETag and lengths of files stay hidden.
  '/faults/shared': (response, request) => {
    response.setHeader('Access-Control-Allow-Origin', '*');
    inParts(response, request);
  },
  // Breaks off in the middle of the second answer.
  '/faults/breaking': (response, request, count) => {
    if (count !== 2) return inParts(response, request);
    const [start, end] = [FIRST_BYTES, glassBytes.length];
    response.writeHead(206, {
      'Content-Length': end - start,
      'Content-Range': `bytes ${start}-${end - 1}/${end}`,
      ETag: '"a"',
    });
    const half = glassBytes.subarray(start, (start + end) / 2);
    // Not at once: what is on its way when a connection is reset may be lost.
    return response.write(half, () => setTimeout(() => response.destroy(), 300));
  },
  '/faults/replaced-once': (response, request, count) =>
    inParts(response, request, { etag: count === 1 ? '"a"' : '"b"' }),
  '/faults/replaced': (response, request, count) =>
    inParts(response, request, { etag: `"${count}"` }),
  // Parts of the compressed file, as servers send them that keep it compressed.
  '/faults/compressed-parts': (response, request) => {
    response.setHeader('Content-Encoding', 'gzip');
    inParts(response, request, { bytes: gzipSync(glassBytes) });
  },
  '/faults/cached': (response, request) => {
    response.setHeader('Cache-Control', 'max-age=3600');
    inParts(response, request);
  },
  '/faults/other-part': (response) => {
    response.writeHead(206, { 'Content-Range': `bytes 1-100/${glassBytes.length}` });
    response.end(glassBytes.subarray(1, 101));
  },
  '/faults/refused': (response) => response.writeHead(416).end(),
  '/half.png': (response) => response.writeHead(200, { 'Content-Type': 'image/png' }).end(HALF),
  // Under the policy that the element is made to live under; with axe-core, which is no part of it.
  '/strict': (response, request) => {
    const lang = new URL(request.url ?? '/', 'http://localhost').searchParams.get('lang') ?? 'en';
    response
      .writeHead(200, {
        'Content-Type': 'text/html',
        'Content-Security-Policy': CONTENT_SECURITY_POLICY,
      })
      .end(
        `<!doctype html><html lang="${lang}"><meta name="viewport" content="width=device-width">` +
          '<title>A window</title><script src="/axe.js"></script>' +
          '<script type="module" src="/relightable-photo/relightable-photo.js"></script>' +
          '<main><h1>A window</h1></main>',
      );
  },
  '/axe.js': (response) =>
    response.writeHead(200, { 'Content-Type': 'text/javascript' }).end(axe.source),
  '/blank': (response) =>
    response
      .writeHead(200, { 'Content-Type': 'text/html' })
      .end('<!doctype html><html lang="en"><title>Blank</title>'),
  '/strictest': (response) =>
    response
      .writeHead(200, {
        'Content-Type': 'text/html',
        'Content-Security-Policy': STRICTEST,
      })
      .end(
        '<!doctype html><html lang="en"><title>Strict</title>' +
          '<link rel="icon" href="/site/icon.svg"><script src="/watch.js"></script>' +
          '<script type="module" src="/relightable-photo/relightable-photo.js"></script>',
      ),
  '/watch.js': (response) =>
    response.writeHead(200, { 'Content-Type': 'text/javascript' }).end(WATCH),
  // For browsers that cannot make one themselves: a second of red, then one of blue.
  '/film.webm': (response, request) => {
    const read = (/** @type {number} */ start, /** @type {number} */ end) => [
      FILM.subarray(start, end),
    ];
    const content = { size: FILM.length, type: 'video/webm', etag: '"film"', read };
    answer(request, response, content).catch(() => {});
  },
  '/bench': (response) =>
    response
      .writeHead(200, { 'Content-Type': 'text/html' })
      .end(
        '<!doctype html><html lang="en"><title>Bench</title><style>body { margin: 0 }</style>' +
          '<script type="module" src="/relightable-photo/relightable-photo.js"></script>',
      ),
};

/** Paths of transfers that the client ended. */
export const aborted = /** @type {string[]} */ ([]);
/** Ranges that were asked for of each address, in order; undefined for the whole file. */
export const asked = /** @type {Map<string, (string | undefined)[]>} */ (new Map());

const serveSite = site({ photos: FOLDER });
/** @type {import('node:http').RequestListener} */
const serve = (request, response) => {
  const url = request.url ?? '/';
  const path = url.split('?', 1)[0] ?? '/';
  response.on('close', () => {
    if (!response.writableFinished) aborted.push(path);
  });
  const ranges = asked.get(url) ?? [];
  asked.set(url, ranges);
  const count = ranges.push(request.headers.range?.replace('bytes=', ''));
  const fault = FAULTS[path];
  if (fault) fault(response, request, count);
  else serveSite(request, response);
};
const [server, otherServer] = await Promise.all([listen(serve, 0), listen(serve, 0)]);
/** @type {Promise<import('playwright-core').Browser> | undefined} */
let chromium;

after(async () => {
  await (await chromium)?.close();
  await Promise.all([server.close(), otherServer.close()]);
});

export const origin = server.url.replace(/\/$/, '');
/** Serves the same, but pages come from `origin`. */
export const otherOrigin = otherServer.url.replace(/\/$/, '');

/**
 * A page of its own, closed when the test ends. Anything a page throws or a policy refuses fails it.
 *
 * @param {import('node:test').TestContext} test
 * @param {string} path
 * @param {import('playwright-core').BrowserContextOptions & { before?: () => void, refusal?: RegExp }} [options]
 *   `before` runs in the page before its own scripts; a `refusal` is what a policy may refuse
 */
export async function openPage(test, path, { before, refusal, ...options } = {}) {
  chromium ??= launchChromium();
  const context = await (await chromium).newContext({ baseURL: origin, ...options });
  const page = await context.newPage();
  /** @type {string[]} */
  const faults = [];
  page.on('pageerror', (error) => faults.push(String(error)));
  page.on('console', (message) => {
    const text = message.text();
    if (refusal?.test(text)) return;
    if (/Content Security Policy|panicked/.test(text)) faults.push(text);
  });
  test.after(async () => {
    await context.close();
    if (faults.length > 0) throw new Error(`the page complained:\n${faults.join('\n')}`);
  });
  if (before) await page.addInitScript(before);
  await page.goto(path);
  return page;
}

/**
 * Puts an element with these attributes into a bench page and records its events.
 *
 * @param {AnyPage} page
 * @param {Record<string, string>} attributes
 */
export async function mount(page, attributes) {
  await page.evaluate(async (attributes) => {
    await customElements.whenDefined('relightable-photo');
    const photo = document.createElement('relightable-photo');
    /** @type {Happening[]} */
    const happened = [];
    const changes = ['lightchange', 'viewchange', 'backendchange', 'contextlost', 'qualitychange'];
    for (const type of ['load', 'progress', 'error', ...changes]) {
      // On the document: events have to travel that far.
      document.addEventListener(type, (event) => {
        const fields = ['code', 'message', 'backend', 'previous', 'reason', 'light', 'torch'];
        const data = [...fields, 'loaded', 'total', 'share', 'zoom', 'x', 'y']
          .filter((field) => field in event)
          .map((field) => [field, /** @type {any} */ (event)[field]]);
        happened.push({ type, ...Object.fromEntries(data) });
      });
    }
    Object.assign(globalThis, { photo, happened });
    for (const [name, value] of Object.entries(attributes)) photo.setAttribute(name, value);
    photo.style.width = '64px';
    (document.querySelector('main') ?? document.body).append(photo);
  }, attributes);
}

/**
 * Waits until an event of this type has happened, and gives all that have, from the first on.
 *
 * @param {AnyPage} page
 * @param {string} type
 * @param {number} [times]
 * @returns {Promise<Happening[]>}
 */
export async function happenedUntil(page, type, times = 1) {
  await page.waitForFunction(
    ([type, times]) => {
      const { happened } = /** @type {any} */ (globalThis);
      return happened.filter((/** @type {Happening} */ e) => e.type === type).length >= times;
    },
    /** @type {const} */ ([type, times]),
  );
  return page.evaluate('happened');
}

/**
 * Waits for `load`. An error in its place is thrown.
 *
 * @param {AnyPage} page
 */
export async function loaded(page) {
  await page.waitForFunction(() => {
    const { happened } = /** @type {any} */ (globalThis);
    return happened.some((/** @type {Happening} */ e) => e.type === 'load' || e.type === 'error');
  });
  /** @type {Happening[]} */
  const happened = await page.evaluate('happened');
  const error = happened.find((event) => event.type === 'error');
  if (error) throw new Error(`${error['code']}: ${error['message']}`);
  return happened;
}

/**
 * Sets attributes and takes the exact picture.
 *
 * @param {AnyPage} page
 * @param {Record<string, string>} [attributes]
 * @param {{ x: number, y: number } | null} [torch]
 */
export async function picture(page, attributes = {}, torch) {
  const url = await page.evaluate(
    async ({ attributes, torch }) => {
      const photo = /** @type {RelightablePhoto} */ (document.querySelector('relightable-photo'));
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
  return decodePng(Buffer.from(url.slice(url.indexOf(',') + 1), 'base64'));
}

/** The element's visible message, as people and screen readers get it. @param {Page} page */
export function message(page) {
  return page.getByRole('alert');
}

/**
 * Looks closer at the element's message: visitors are told in short, and all of it where they ask.
 *
 * @param {Page} page
 */
export async function details(page) {
  await message(page)
    .getByText(/cannot be shown|not work as intended/)
    .waitFor({ state: 'visible' });
  const details = page.locator('relightable-photo details');
  await details.evaluate((element) => element.setAttribute('open', ''));
  return message(page);
}

/**
 * Waits for something this process sees, not the page.
 *
 * @param {() => boolean} condition
 * @param {string} what is waited for
 */
export async function until(condition, what) {
  const deadline = Date.now() + UNTIL_MS;
  while (!condition()) {
    if (Date.now() > deadline) throw new Error(`waited ${UNTIL_MS / 1000} s for ${what}`);
    await new Promise((resolve) => setTimeout(resolve, 20));
  }
}

/** For pages to run first: as in a browser without graphics devices. */
export const withoutGpus = () => {
  Object.defineProperty(Navigator.prototype, 'gpu', { get: () => undefined });
  const { getContext } = HTMLCanvasElement.prototype;
  HTMLCanvasElement.prototype.getContext = /** @type {any} */ (
    /** @this {HTMLCanvasElement} @param {string} kind @param {any[]} rest */
    function (kind, ...rest) {
      return kind === 'webgl2' ? null : Reflect.apply(getContext, this, [kind, ...rest]);
    }
  );
};
