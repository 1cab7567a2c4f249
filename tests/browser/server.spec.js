/** The demo site's server: range requests, validators, and which paths it serves. */

import { renameSync, writeFileSync } from 'node:fs';
import { request } from 'node:http';
import { join } from 'node:path';
import { expect, test } from './fixtures.js';
import { FOLDER, glassBytes } from './test-photos.js';

const GLASS = '/photos/glass.ltm';

/**
 * Sends one request. Unlike `fetch`, it adds no headers and does not change the path.
 *
 * @param {string} origin
 * @param {string} path
 * @param {Record<string, string>} [headers]
 * @param {string} [method]
 * @returns {Promise<{ status: number | undefined, headers: import('node:http').IncomingHttpHeaders, body: Buffer }>}
 */
function send(origin, path, headers = {}, method = 'GET') {
  return new Promise((resolve, reject) => {
    const outgoing = request(origin + path, { method, headers }, async (response) => {
      const body = Buffer.concat(await response.toArray());
      resolve({ status: response.statusCode, headers: response.headers, body });
    });
    outgoing.on('error', reject).end();
  });
}

/** Parts by what they are; a range may depend on the size of the file. @type {[part: string, range: (size: number) => string, start: (size: number) => number, end: (size: number) => number][]} */
const PARTS = [
  ['the first byte', () => '0-0', () => 0, () => 1],
  ['a hundred bytes in the middle', () => '100-199', () => 100, () => 200],
  ['all from a byte on', () => '16384-', () => 16384, (size) => size],
  [
    'what exists of a range past the end',
    (size) => `${size - 1}-${size + 999}`,
    (size) => size - 1,
    (size) => size,
  ],
  ['all for a huge end', () => '0-99999999999999999999', () => 0, (size) => size],
  ['the last hundred bytes', () => '-100', (size) => size - 100, (size) => size],
  ['all for a suffix longer than the file', (size) => `-${size + 1}`, () => 0, (size) => size],
];

/** @type {[range: string, value: (size: number) => string][]} */
const UNSATISFIABLE_RANGES = [
  ['from the end on', (size) => `${size}-`],
  ['past the end', (size) => `${size}-${size + 9}`],
  ['of the last 0 bytes', () => '-0'],
];

test.describe('the server', () => {
  test('sends a whole photograph with its size, type and validator', async ({ server }) => {
    for (const method of ['GET', 'HEAD']) {
      const { status, headers, body } = await send(server.origin, GLASS, {}, method);
      expect(status).toBe(200);
      expect(headers['content-type']).toBe('application/vnd.ltm');
      expect(headers['content-length']).toBe(String(glassBytes().length));
      expect(headers['accept-ranges']).toBe('bytes');
      expect(headers['content-encoding']).toBeUndefined();
      expect(headers['cache-control']).toBe('no-cache, no-transform');
      expect(headers.etag, 'a strong validator').toMatch(/^"[^"]+"$/);
      expect(body.equals(method === 'GET' ? glassBytes() : Buffer.alloc(0))).toBe(true);
    }
  });

  for (const [part, range, first, last] of PARTS) {
    test(`sends a part: ${part}`, async ({ server }) => {
      const size = glassBytes().length;
      const [start, end] = [first(size), last(size)];
      const sent = await send(server.origin, GLASS, { range: `bytes=${range(size)}` });
      const { status, headers, body } = sent;
      expect(status).toBe(206);
      expect(headers['content-range']).toBe(`bytes ${start}-${end - 1}/${size}`);
      expect(headers['content-length']).toBe(String(end - start));
      expect(headers['content-type']).toBe('application/vnd.ltm');
      expect(body.equals(glassBytes().subarray(start, end))).toBe(true);
    });
  }

  for (const [range, value] of UNSATISFIABLE_RANGES) {
    test(`refuses a range ${range}`, async ({ server }) => {
      const size = glassBytes().length;
      const sent = await send(server.origin, GLASS, { range: `bytes=${value(size)}` });
      const { status, headers, body } = sent;
      expect(status).toBe(416);
      expect(headers['content-range']).toBe(`bytes */${size}`);
      expect(body.length).toBe(0);
    });
  }

  test('refuses every range of an empty file', async ({ server }) => {
    const empty = '/photos/empty.ltm';
    const { status, headers } = await send(server.origin, empty, { range: 'bytes=0-99' });
    expect(status).toBe(416);
    expect(headers['content-range']).toBe('bytes */0');
    expect((await send(server.origin, empty)).status).toBe(200);
  });

  for (const range of ['bytes=9-5', 'bytes=-', 'bytes=0-1,5-6', 'bytes=a-b', 'lines=0-9', '0-9']) {
    test(`ignores the Range header "${range}"`, async ({ server }) => {
      const { status, headers, body } = await send(server.origin, GLASS, { range });
      expect(status).toBe(200);
      expect(headers['content-range']).toBeUndefined();
      expect(body.length).toBe(glassBytes().length);
    });
  }

  test('sends the whole file when If-Range does not match', async ({ server }) => {
    const { headers } = await send(server.origin, GLASS);
    const etag = headers.etag ?? '';
    const modified = headers['last-modified'] ?? '';
    for (const [validator, status] of /** @type {const} */ ([
      [etag, 206],
      ['"another"', 200],
      [`W/${etag}`, 200],
      [modified, 200],
    ])) {
      const part = { range: 'bytes=5-9', 'if-range': validator };
      expect((await send(server.origin, GLASS, part)).status, validator).toBe(status);
    }
  });

  test('sends no body when If-None-Match matches', async ({ server }) => {
    const etag = (await send(server.origin, GLASS)).headers.etag ?? '';
    for (const known of [etag, `W/${etag}`, `"other", ${etag}`, '*']) {
      const sent = await send(server.origin, GLASS, { 'if-none-match': known });
      expect([sent.status, sent.headers.etag, sent.body.length]).toStrictEqual([304, etag, 0]);
    }
    expect((await send(server.origin, GLASS, { 'if-none-match': '"other"' })).status).toBe(200);
  });

  test('changes the ETag of a file that is replaced', async ({ server }) => {
    const [path, next] = [join(FOLDER, 'replaced.ltm'), join(FOLDER, 'next.ltm')];
    const tags = new Set();
    for (let i = 0; i < 5; i += 1) {
      writeFileSync(next, `always of one length, ${i}`);
      renameSync(next, path);
      tags.add((await send(server.origin, '/photos/replaced.ltm')).headers.etag);
    }
    expect(tags.size).toBe(5);
  });

  for (const path of [
    '/photos/notes.txt',
    '/photos/',
    '/photos',
    '/photos/.ltm/',
    '/photos/%00.ltm',
    '/photos/%zz.ltm',
    '/photos/../outside.ltm',
    '/photos/..%2foutside.ltm',
    '/photos/%2e%2e%2foutside.ltm',
    '/src/index.ts',
  ]) {
    test(`answers 404 for ${path}`, async ({ server }) => {
      writeFileSync(join(FOLDER, '../outside.ltm'), 'not served');
      writeFileSync(join(FOLDER, 'notes.txt'), 'not served');
      expect((await send(server.origin, path)).status).toBe(404);
    });
  }

  test('accepts GET and HEAD only', async ({ server }) => {
    const { status, headers } = await send(server.origin, GLASS, {}, 'POST');
    expect([status, headers.allow]).toStrictEqual([405, 'GET, HEAD']);
  });
});
