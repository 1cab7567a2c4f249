/** The server of the browser tests: the site, the test photographs, faulty transfers and pages for single elements. */

import { createHash } from 'node:crypto';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { gzipSync } from 'node:zlib';
import axe from 'axe-core';
import { encodePng } from '../../www/tools/pictures.js';
import { answer } from '../../www/tools/ranges.js';
import { listen } from '../../www/tools/serve.js';
import { CONTENT_SECURITY_POLICY, site } from '../../www/tools/site.js';
import { monitorPage } from './page-monitor.js';
import { zipFixture } from './recovery-page.js';
import { FOLDER, glassBytes } from './test-photos.js';

/** @typedef {import('node:http').ServerResponse} Response */
/** @typedef {import('node:http').IncomingMessage} Request */
/** @typedef {(response: Response, request: Request, count: number) => unknown} Handler `count` is 1 with an address's first request */
/** @typedef {Awaited<ReturnType<typeof startTestServer>>} TestServer */

/** Size of the element's first range request. */
export const FIRST_BYTES = 1 << 14;

/** Playwright inserts this style sheet into Firefox's pages for each screenshot. */
const PLAYWRIGHT_STYLE_HASH = `sha256-${createHash('sha256').update('body {}').digest('base64')}`;
/** The strictest policy that the element supports, on a page that plays a video of its own. */
const MONITORED_PAGE_POLICY =
  `default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self' '${PLAYWRIGHT_STYLE_HASH}'; ` +
  "img-src 'self'; connect-src 'self'; media-src 'self'";
/** Scripts get addresses only from the element's own policy. */
const TRUSTED_TYPES = "require-trusted-types-for 'script'; trusted-types relightable-photo";
const ELEMENT = '<script type="module" src="/relightable-photo/relightable-photo.js"></script>';
/** A second of red, then a second of blue. */
const FILM = readFileSync(join(import.meta.dirname, '../fixtures/red-then-blue.webm'));
const SLOW_TRANSFER_PIECES = 40;
const SLOW_TRANSFER_INTERVAL_MS = 50;

const OPENSEADRAGON = readFileSync(fileURLToPath(import.meta.resolve('openseadragon')), 'utf8');

/** White on the left, black on the right. */
const HALF_WHITE = encodePng({
  width: 10,
  height: 10,
  data: Uint8Array.from({ length: 400 }, (_, i) => (i % 4 === 3 || i % 40 < 20 ? 255 : 0)),
});

/**
 * Sends a whole body of a type.
 *
 * @param {string} type
 * @param {() => string | Buffer} body
 * @param {Record<string, string>} [headers]
 * @returns {Handler}
 */
const send =
  (type, body, headers = {}) =>
  (response) =>
    response.writeHead(200, { 'Content-Type': type, ...headers }).end(body());

/** @param {string} head @param {string} [body] */
const page = (head, body = '') =>
  `<!doctype html><html lang="en"><title>Test</title>${head}${body}`;

/**
 * Sends the photograph compressed, to pages of every origin.
 *
 * @param {number} level of gzip; at 0 the transfer is longer than the file
 * @returns {Handler}
 */
const sendGzipped = (level) => (response) => {
  const body = gzipSync(glassBytes(), { level });
  const cors = { 'Access-Control-Allow-Origin': '*', 'Content-Encoding': 'gzip' };
  response.writeHead(200, { ...cors, 'Content-Length': body.length }).end(body);
};

/**
 * Sends a file, or the range that is requested.
 *
 * @param {Response} response
 * @param {Request} request
 * @param {{ etag?: string, bytes?: Buffer, type?: string }} [file]
 */
function sendRange(response, request, file = {}) {
  const { etag = '"a"', bytes = glassBytes(), type = 'application/vnd.ltm' } = file;
  const read = (/** @type {number} */ start, /** @type {number} */ end) => [
    bytes.subarray(start, end),
  ];
  // A client that closes the connection makes the transfer fail.
  answer(request, response, { size: bytes.length, type, etag, read }).catch(() => {});
}

/** The first half of the photograph. */
const firstHalf = () => glassBytes().subarray(0, glassBytes().length / 2);

/** Files of tests/fixtures. @type {Handler} */
const sendFixture = (response, request) => {
  const bytes = readFileSync(join(import.meta.dirname, '..', request.url ?? ''));
  response.writeHead(200, { 'Content-Length': bytes.length }).end(bytes);
};

/** Handlers by path. @type {Record<string, Handler>} */
const HANDLERS = {
  '/faults/status': (response) => response.writeHead(503, 'Service Unavailable').end('later'),
  '/faults/html': send('text/html', () => '<h1>Please log in</h1>'),
  // Declares the whole length, sends half and closes the connection.
  '/faults/short': (response) => {
    response.writeHead(200, { 'Content-Length': glassBytes().length });
    response.write(firstHalf(), () => response.destroy());
  },
  // Sends half in chunks, without a length, and closes the connection.
  '/faults/cut': (response) => {
    response.writeHead(200);
    response.write(firstHalf(), () => response.destroy());
  },
  // Without a length and without chunks, as in HTTP/1.0: the client cannot tell a cut from the end.
  '/faults/cut-silently': (response) => {
    response.useChunkedEncodingByDefault = false;
    response.shouldKeepAlive = false;
    response.writeHead(200, { Connection: 'close' });
    response.end(firstHalf());
  },
  '/faults/no-answer': (response) => response.destroy(),
  // Complete, but slow enough for tests to act during the transfer.
  '/faults/slow': async (response) => {
    const bytes = glassBytes();
    response.writeHead(200, { 'Content-Length': bytes.length });
    const piece = Math.ceil(bytes.length / SLOW_TRANSFER_PIECES);
    for (let at = 0; at < bytes.length && !response.destroyed; at += piece) {
      response.write(bytes.subarray(at, at + piece));
      await new Promise((resolve) => setTimeout(resolve, SLOW_TRANSFER_INTERVAL_MS));
    }
    response.end();
  },
  '/faults/gzipped': sendGzipped(9),
  '/faults/gzipped-longer': sendGzipped(0),
  // Pages of other origins may read the body, but not Content-Range, ETag and the file's length.
  '/faults/shared': (response, request) => {
    response.setHeader('Access-Control-Allow-Origin', '*');
    sendRange(response, request);
  },
  // Closes the connection in the middle of the second response.
  '/faults/breaking': (response, request, count) => {
    if (count !== 2) return sendRange(response, request);
    const [start, end] = [FIRST_BYTES, glassBytes().length];
    response.writeHead(206, {
      'Content-Length': end - start,
      'Content-Range': `bytes ${start}-${end - 1}/${end}`,
      ETag: '"a"',
    });
    const half = glassBytes().subarray(start, (start + end) / 2);
    // A reset may discard bytes that the client has not read yet.
    return response.write(half, () => setTimeout(() => response.destroy(), 300));
  },
  '/faults/replaced-once': (response, request, count) =>
    sendRange(response, request, { etag: count === 1 ? '"a"' : '"b"' }),
  '/faults/replaced': (response, request, count) =>
    sendRange(response, request, { etag: `"${count}"` }),
  // Ranges of the compressed file, as some servers send them.
  '/faults/compressed-parts': (response, request) => {
    response.setHeader('Content-Encoding', 'gzip');
    sendRange(response, request, { bytes: gzipSync(glassBytes()) });
  },
  '/faults/cached': (response, request) => {
    response.setHeader('Cache-Control', 'max-age=3600');
    sendRange(response, request);
  },
  '/faults/other-part': (response) => {
    response.writeHead(206, { 'Content-Range': `bytes 1-100/${glassBytes().length}` });
    response.end(glassBytes().subarray(1, 101));
  },
  '/faults/refused': (response) => response.writeHead(416).end(),
  '/glass-s.zip': async (response) =>
    response.writeHead(200, { 'Content-Type': 'application/zip' }).end(await zipFixture()),
  '/half.png': send('image/png', () => HALF_WHITE),
  '/film.webm': (response, request) =>
    sendRange(response, request, { etag: '"film"', bytes: FILM, type: 'video/webm' }),
  // No script, no element and no request for an icon.
  '/blank': send('text/html', () => page('<link rel="icon" href="data:,">')),
  // The element, without a policy.
  '/plain': send('text/html', () => page(`<style>body { margin: 0 }</style>${ELEMENT}`)),
  // The element and axe-core under the site's policy, in the language of `lang`.
  '/strict': (response, request) => {
    const lang = new URL(request.url ?? '/', 'http://localhost').searchParams.get('lang') ?? 'en';
    const headers = { 'Content-Security-Policy': CONTENT_SECURITY_POLICY };
    const html =
      `<!doctype html><html lang="${lang}"><meta name="viewport" content="width=device-width">` +
      `<title>A window</title><script src="/axe.js"></script>${ELEMENT}<main><h1>A window</h1></main>`;
    send('text/html', () => html, headers)(response, request, 1);
  },
  // A viewer's script and its box, with the size of the photograph of several levels.
  '/viewer': send('text/html', () =>
    page(
      '<style>body { margin: 0 } #viewer { width: 523px; height: 41px }</style>' +
        '<script src="/openseadragon.js"></script>',
      '<div id="viewer"></div>',
    ),
  ),
  '/openseadragon.js': send('text/javascript', () => OPENSEADRAGON),
  '/axe.js': send('text/javascript', () => axe.source),
  // The element under the strictest policy, with the page monitor.
  '/monitored': send(
    'text/html',
    () =>
      page(
        `<link rel="icon" href="/site/icon.svg"><script src="/page-monitor.js"></script>${ELEMENT}`,
      ),
    { 'Content-Security-Policy': MONITORED_PAGE_POLICY },
  ),
  // The same, with Trusted Types.
  '/trusted-types/monitored': send(
    'text/html',
    () => page(`<script src="/page-monitor.js"></script>${ELEMENT}`),
    { 'Content-Security-Policy': `${MONITORED_PAGE_POLICY}; ${TRUSTED_TYPES}` },
  ),
  '/page-monitor.js': send('text/javascript', () => `(${monitorPage})()`),
};

/** Starts the server on two ports, which are two origins. */
export async function startTestServer() {
  /** Paths of the responses that the client did not receive to their end. @type {string[]} */
  const abortedPaths = [];
  /** Requested ranges by address, in order; undefined for a whole file. @type {Map<string, (string | undefined)[]>} */
  const requestedRanges = new Map();
  const serveSite = site({ photos: FOLDER });
  /** @type {import('node:http').RequestListener} */
  const serve = (request, response) => {
    const url = request.url ?? '/';
    const path = url.split('?', 1)[0] ?? '/';
    response.on('close', () => {
      if (!response.writableFinished) abortedPaths.push(path);
    });
    const ranges = requestedRanges.get(url) ?? [];
    requestedRanges.set(url, ranges);
    const count = ranges.push(request.headers.range?.replace('bytes=', ''));
    const handler = path.startsWith('/fixtures/') ? sendFixture : HANDLERS[path];
    if (handler) handler(response, request, count);
    else serveSite(request, response);
  };
  const [own, other] = await Promise.all([listen(serve, 0), listen(serve, 0)]);
  return {
    origin: own.url.replace(/\/$/, ''),
    otherOrigin: other.url.replace(/\/$/, ''),
    abortedPaths,
    requestedRanges,
    close: async () => {
      await Promise.all([own.close(), other.close()]);
    },
  };
}
