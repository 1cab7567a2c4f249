/** The demo site as a request handler: the page, the built element, the photographs. */

import { join } from 'node:path';
import sirv from 'sirv';

const repository = join(import.meta.dirname, '..', '..');

/** All the page is made of. The folder also holds sources, which are nobody's to fetch. */
const PAGE_FILES = new Set(['/', '/index.html', '/page.css', '/page.js', '/icon.svg']);

/**
 * What the element is made to live under: no other hosts, no inline code or style, no eval, no
 * `blob:` or `data:`. WebAssembly has to be allowed by name.
 */
const CONTENT_SECURITY_POLICY =
  "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self'; connect-src 'self'";

/**
 * @param {{ photos: string }} options folder that is served as /photos/
 * @returns {(request: import('node:http').IncomingMessage, response: import('node:http').ServerResponse) => void}
 */
export function site({ photos }) {
  const options = {
    // Files are looked up at each request: they may be rebuilt under a running server.
    dev: true,
    etag: true,
    /** @param {import('node:http').ServerResponse} response @param {string} path */
    setHeaders(response, path) {
      response.setHeader('Cache-Control', 'no-cache');
      response.setHeader('Content-Security-Policy', CONTENT_SECURITY_POLICY);
      if (path.endsWith('.ltm')) response.setHeader('Content-Type', 'application/octet-stream');
    },
  };
  const page = sirv(join(repository, 'www'), options);
  const mounts = [
    { at: '/relightable-photo/', serve: sirv(join(repository, 'dist'), options) },
    { at: '/photos/', serve: sirv(photos, options) },
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
