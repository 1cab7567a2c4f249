/** A request handler for the site: its pages, the built element and the photographs. */

import { readFileSync } from 'node:fs';
import { open } from 'node:fs/promises';
import { extname, join, resolve, sep } from 'node:path';
import sirv from 'sirv';
import { packPackage } from './package-archive.js';
import { ARCHIVE, cachedPages, MANIFEST, manifestAt } from './pages.js';
import { answer } from './ranges.js';

/** @typedef {import('node:http').IncomingMessage} Request */
/** @typedef {import('node:http').ServerResponse} Response */

const repository = join(import.meta.dirname, '..', '..');

/** The folders that are served, by their paths on the site. */
export const FOLDERS = {
  '/relightable-photo/': 'dist',
  // The first folder whose path matches is served.
  '/site/wasm/': 'target/wasm/site',
  '/site/': 'www/site',
  '/samples/': 'docs/samples',
  '/docs/images/': 'docs/images',
};

/** Files of npm packages that are served. */
export const FILES = {
  '/fonts/source-serif-4.woff2': font('source-serif-4-latin-wght-normal.woff2'),
  '/fonts/source-serif-4-italic.woff2': font('source-serif-4-latin-wght-italic.woff2'),
  '/vendor/zip.js': join(repository, 'node_modules/@zip.js/zip.js/index-native.min.js'),
  '/vendor/minisearch.js': join(repository, 'node_modules/minisearch/dist/es/index.js'),
};

/**
 * The strictest policy under which the element works: no other hosts, no inline code or style, no `eval`, and neither
 * `blob:` nor `data:` URLs. WebAssembly needs a permission of its own. The pages themselves need fonts, and `blob:` for
 * videos that visitors choose.
 */
export const CONTENT_SECURITY_POLICY =
  "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self'; font-src 'self'; connect-src 'self'; media-src 'self' blob:";

/** @type {Record<string, string>} */
const PHOTO_TYPES = { '.ltm': 'application/vnd.ltm', '.png': 'image/png' };
/** @type {Record<string, string>} */
const TYPES = {
  '.html': 'text/html; charset=utf-8',
  '.js': 'text/javascript',
  '.json': 'application/json',
  '.tgz': 'application/gzip',
  '.woff2': 'font/woff2',
};

/**
 * @param {{ photos: string }} options folder whose `.ltm` and `.png` files are served below /photos/
 * @returns {(request: Request, response: Response) => void}
 */
export function site({ photos }) {
  const options = {
    // Looks files up at each request, because they may be rebuilt meanwhile.
    dev: true,
    etag: true,
    /** @param {Response} response */
    setHeaders(response) {
      response.setHeader('Cache-Control', 'no-cache');
      response.setHeader('Content-Security-Policy', CONTENT_SECURITY_POLICY);
    },
  };
  const mounts = [
    ...Object.entries(FOLDERS).map(([at, folder]) => ({
      at,
      serve: sirv(join(repository, folder), options),
    })),
    { at: '/photos/', serve: photographs(photos) },
  ];
  const pages = cachedPages();
  /** @param {Request} request @param {Response} response */
  const serve = async (request, response) => {
    const missing = () => {
      response.writeHead(404, { 'Content-Type': 'text/plain' }).end('Not found\n');
    };
    const url = request.url ?? '/';
    if (request.method !== 'GET' && request.method !== 'HEAD') {
      response.writeHead(405, { Allow: 'GET, HEAD' }).end();
      return;
    }
    const path = url.split('?', 1)[0] ?? '';
    /** @param {string | Buffer} content */
    const send = (content, type = TYPES[extname(path)] ?? '') => {
      options.setHeaders(response);
      response.setHeader('Content-Type', type).end(content);
    };
    if (path === `/${MANIFEST}`) {
      send(manifestAt(`http://${request.headers.host}/`), 'application/ld+json');
      return;
    }
    for (const { at, serve } of mounts) {
      if (url.startsWith(at)) {
        request.url = url.slice(at.length - 1);
        serve(request, response, missing);
        return;
      }
    }
    const file = FILES[/** @type {keyof typeof FILES} */ (path)];
    if (file) send(readFileSync(file));
    else if (path === `/${ARCHIVE}`) send(readFileSync(packPackage()));
    else {
      const page = (await pages()).get(path === '/' ? 'index.html' : path.slice(1));
      if (page === undefined) missing();
      else send(page, path === '/' ? TYPES['.html'] : undefined);
    }
  };
  return (request, response) => {
    serve(request, response).catch((error) => {
      console.error(error);
      response.writeHead(500, { 'Content-Type': 'text/plain' }).end(`${error.stack}\n`);
    });
  };
}

/** @param {string} name */
function font(name) {
  return join(repository, 'node_modules/@fontsource-variable/source-serif-4/files', name);
}

/**
 * Serves the photographs of a folder, with range requests.
 *
 * @param {string} folder
 * @returns {(request: Request, response: Response, missing: () => void) => void}
 */
function photographs(folder) {
  const root = resolve(folder) + sep;
  return (request, response, missing) => {
    const path = photographAt(root, request.url ?? '/');
    if (!path) return missing();
    // A failed transfer ends the connection; there is no other way to report it.
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
  // An open file stays the same even if it is replaced.
  try {
    const stats = await file.stat({ bigint: true });
    if (!stats.isFile()) return missing();
    // A proxy that compresses a range would make it unreadable.
    response.setHeader('Cache-Control', 'no-cache, no-transform');
    response.setHeader('Last-Modified', stats.mtime.toUTCString());
    await answer(request, response, {
      size: Number(stats.size),
      type: PHOTO_TYPES[extname(path)] ?? '',
      etag: `"${[stats.ino, stats.mtimeNs, stats.size].map((n) => n.toString(36)).join('-')}"`,
      read: (start, end) => file.createReadStream({ start, end: end - 1, autoClose: false }),
    });
  } finally {
    await file.close();
  }
}

/**
 * The path of a requested photograph; `undefined` for anything outside of the folder and for other types of files.
 *
 * @param {string} root ends in a separator
 * @param {string} url
 */
function photographAt(root, url) {
  try {
    const path = join(root, decodeURIComponent(url.split('?', 1)[0] ?? ''));
    return path.startsWith(root) && extname(path) in PHOTO_TYPES ? path : undefined;
  } catch {
    return undefined; // not UTF-8
  }
}
