/** How the demo's server hands out photographs, and what else it does not. */

import assert from 'node:assert/strict';
import { renameSync, writeFileSync } from 'node:fs';
import { request } from 'node:http';
import { join } from 'node:path';
import { describe, test } from 'node:test';
import { origin } from './browser.js';
import { FOLDER, glassBytes } from './photos.js';

const GLASS = '/photos/glass.ltm';

/**
 * Asks as it is told, without a browser's or `fetch`'s own ideas.
 *
 * @param {string} path
 * @param {Record<string, string>} [headers]
 * @param {string} [method]
 * @returns {Promise<{ status: number | undefined, headers: import('node:http').IncomingHttpHeaders, body: Buffer }>}
 */
function ask(path, headers = {}, method = 'GET') {
  return new Promise((resolve, reject) => {
    const asking = request(origin + path, { method, headers }, async (response) => {
      const body = Buffer.concat(await response.toArray());
      resolve({ status: response.statusCode, headers: response.headers, body });
    });
    asking.on('error', reject).end();
  });
}

describe('the server', () => {
  const size = glassBytes.length;

  test('sends a whole photograph, with what tells it from others', async () => {
    for (const method of ['GET', 'HEAD']) {
      const { status, headers, body } = await ask(GLASS, {}, method);
      assert.equal(status, 200);
      assert.equal(headers['content-type'], 'application/vnd.ltm');
      assert.equal(headers['content-length'], String(size));
      assert.equal(headers['accept-ranges'], 'bytes');
      assert.equal(headers['content-encoding'], undefined);
      assert.equal(headers['cache-control'], 'no-cache, no-transform');
      assert.match(headers.etag ?? '', /^"[^"]+"$/, 'a strong one');
      assert.ok(body.equals(method === 'GET' ? glassBytes : Buffer.alloc(0)));
    }
  });

  /** @type {[asked: string, start: number, end: number][]} */
  const parts = [
    ['0-0', 0, 1],
    ['100-199', 100, 200],
    ['16384-', 16384, size],
    [`${size - 1}-${size + 999}`, size - 1, size],
    ['0-99999999999999999999', 0, size],
    ['-100', size - 100, size],
    [`-${size + 1}`, 0, size],
  ];
  for (const [asked, start, end] of parts) {
    test(`sends the part ${asked}`, async () => {
      const { status, headers, body } = await ask(GLASS, { range: `bytes=${asked}` });
      assert.equal(status, 206);
      assert.equal(headers['content-range'], `bytes ${start}-${end - 1}/${size}`);
      assert.equal(headers['content-length'], String(end - start));
      assert.equal(headers['content-type'], 'application/vnd.ltm');
      assert.ok(body.equals(glassBytes.subarray(start, end)));
    });
  }

  for (const asked of [`${size}-`, `${size}-${size + 9}`, '-0']) {
    test(`has no part ${asked}`, async () => {
      const { status, headers, body } = await ask(GLASS, { range: `bytes=${asked}` });
      assert.equal(status, 416);
      assert.equal(headers['content-range'], `bytes */${size}`);
      assert.equal(body.length, 0);
    });
  }

  test('has no part of an empty file', async () => {
    const { status, headers } = await ask('/photos/empty.ltm', { range: 'bytes=0-99' });
    assert.equal(status, 416);
    assert.equal(headers['content-range'], 'bytes */0');
    assert.equal((await ask('/photos/empty.ltm')).status, 200);
  });

  for (const asked of ['bytes=9-5', 'bytes=-', 'bytes=0-1,5-6', 'bytes=a-b', 'lines=0-9', '0-9']) {
    test(`sends all where it is asked for ${asked}`, async () => {
      const { status, headers, body } = await ask(GLASS, { range: asked });
      assert.equal(status, 200);
      assert.equal(headers['content-range'], undefined);
      assert.equal(body.length, size);
    });
  }

  test('sends all in place of a part of what is no longer there', async () => {
    const { headers } = await ask(GLASS);
    const part = { range: 'bytes=5-9' };
    const etag = headers.etag ?? '';
    assert.equal((await ask(GLASS, { ...part, 'if-range': etag })).status, 206);
    assert.equal((await ask(GLASS, { ...part, 'if-range': '"another"' })).status, 200);
    assert.equal((await ask(GLASS, { ...part, 'if-range': `W/${etag}` })).status, 200);
    const modified = headers['last-modified'] ?? '';
    assert.equal((await ask(GLASS, { ...part, 'if-range': modified })).status, 200);
  });

  test('sends nothing where the client has it already', async () => {
    const etag = (await ask(GLASS)).headers.etag ?? '';
    for (const known of [etag, `W/${etag}`, `"other", ${etag}`, '*']) {
      const { status, headers, body } = await ask(GLASS, { 'if-none-match': known });
      assert.deepEqual([status, headers.etag, body.length], [304, etag, 0]);
    }
    assert.equal((await ask(GLASS, { 'if-none-match': '"other"' })).status, 200);
  });

  test('names a file that takes the place of another otherwise', async () => {
    const [path, next] = [join(FOLDER, 'replaced.ltm'), join(FOLDER, 'next.ltm')];
    const tags = new Set();
    for (let i = 0; i < 5; i += 1) {
      writeFileSync(next, `as long as ever, ${i}`);
      renameSync(next, path);
      tags.add((await ask('/photos/replaced.ltm')).headers.etag);
    }
    assert.equal(tags.size, 5);
  });

  writeFileSync(join(FOLDER, '../outside.ltm'), 'not to be had');
  writeFileSync(join(FOLDER, 'notes.txt'), 'not to be had');
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
    test(`has nothing at ${path}`, async () => {
      assert.equal((await ask(path)).status, 404);
    });
  }

  test('takes GET and HEAD only', async () => {
    const { status, headers } = await ask(GLASS, {}, 'POST');
    assert.deepEqual([status, headers.allow], [405, 'GET, HEAD']);
  });
});
