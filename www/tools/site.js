/** The demo site as a request handler: the page, the built element, the photographs. */

import { open } from 'node:fs/promises';
import { join, resolve, sep } from 'node:path';
import sirv from 'sirv';
import { answer } from './ranges.js';

/** @typedef {import('node:http').IncomingMessage} Request */
/** @typedef {import('node:http').ServerResponse} Response */

const repository = join(import.meta.dirname, '..', '..');

/** All the page is made of. The folder also holds sources, which are nobody's to fetch. */
const PAGE_FILES = new Set(['/', '/index.html', '/page.css', '/page.js', '/icon.svg']);

/**
 * What the element is made to live under: no other hosts, no inline code or style, no eval, no
 * `blob:` or `data:`. WebAssembly has to be allowed by name. Films that visitors choose are the page's
 * own affair.
 */
export const CONTENT_SECURITY_POLICY =
  "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self'; connect-src 'self'; media-src blob:";

/**
 * @param {{ photos: string }} options folder whose `.ltm` files are served below /photos/
 * @returns {(request: Request, response: Response) => void}
 */
export function site({ photos }) {
  const options = {
    // Files are looked up at each request: they may be rebuilt under a running server.
    dev: true,
    etag: true,
    /** @param {Response} response */
    setHeaders(response) {
      response.setHeader('Cache-Control', 'no-cache');
      response.setHeader('Content-Security-Policy', CONTENT_SECURITY_POLICY);
    },
  };
  const page = sirv(join(repository, 'www'), options);
  const mounts = [
    { at: '/relightable-photo/', serve: sirv(join(repository, 'dist'), options) },
    { at: '/photos/', serve: photographs(photos) },
  ];
  return (request, response) => {
    const missing = () => {
      response.writeHead(404, { 'Content-Type': 'text/plain' }).end('Not found\n');
    };
    const url = request.url ?? '/';
    if (request.method !== 'GET' && request.method !== 'HEAD') {
      response.writeHead(405, { Allow: 'GET, HEAD' }).end();
      return;
    }
    for (const { at, serve } of mounts) {
      if (url.startsWith(at)) {
        request.url = url.slice(at.length - 1);
        serve(request, response, missing);
        return;
      }
    }
    if (PAGE_FILES.has(url.split('?', 1)[0] ?? '')) page(request, response, missing);
    else missing();
  };
}

/**
 * Serves the photographs of a folder, in parts where parts are asked for.
 *
 * @param {string} folder
 * @returns {(request: Request, response: Response, missing: () => void) => void}
 */
function photographs(folder) {
  const root = resolve(folder) + sep;
  return (request, response, missing) => {
    const path = photographAt(root, request.url ?? '/');
    if (!path) return missing();
    // A transfer that the client ends, or that fails, has nobody to tell.
    send(path, request, response, missing).catch(() => response.destroy());
  };
}

/**
 * @param {string} path
 * @param {Request} request
 * @param {Response} response
 * @param {() => void} missing
 */
async function send(path, request, response, missing) {
  const file = await open(path).catch(() => undefined);
  if (!file) return missing();
  // What is open stays the same file when another takes its place.
  try {
    const stats = await file.stat({ bigint: true });
    if (!stats.isFile()) return missing();
    // Compressed on their way, parts would be no parts of the file.
    response.setHeader('Cache-Control', 'no-cache, no-transform');
    response.setHeader('Last-Modified', stats.mtime.toUTCString());
    await answer(request, response, {
      size: Number(stats.size),
      type: 'application/vnd.ltm',
      etag: `"${[stats.ino, stats.mtimeNs, stats.size].map((n) => n.toString(36)).join('-')}"`,
      read: (start, end) => file.createReadStream({ start, end: end - 1, autoClose: false }),
    });
  } finally {
    await file.close();
  }
}

/**
 * The photograph that a request is for; none where it leads out of the folder or to anything else.
 *
 * @param {string} root ends in a separator
 * @param {string} url
 */
function photographAt(root, url) {
  try {
    const path = join(root, decodeURIComponent(url.split('?', 1)[0] ?? ''));
    return path.startsWith(root) && path.endsWith('.ltm') ? path : undefined;
  } catch {
    return undefined; // no text in UTF-8
  }
}
