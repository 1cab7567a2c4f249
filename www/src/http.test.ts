import assert from 'node:assert/strict';
import test from 'node:test';
import { body, checkHead, nameOf, request } from './http.js';

const URL_ = 'https://museum.example/windows/rose.ltm?v=2';
const never = new AbortController().signal;

async function drain(response: Response, fileBytes?: number, stallMs?: number): Promise<number> {
  let bytes = 0;
  for await (const piece of body(URL_, response, never, () => fileBytes, stallMs)) {
    bytes += piece.byteLength;
  }
  return bytes;
}

/** A body that gives these pieces, then ends, fails or falls silent. */
function bodyOf(pieces: number[], end: 'ends' | 'fails' | 'hangs'): ReadableStream<Uint8Array> {
  return new ReadableStream({
    pull(controller) {
      const next = pieces.shift();
      if (next !== undefined) controller.enqueue(new Uint8Array(next));
      else if (end === 'ends') controller.close();
      else if (end === 'fails') controller.error(new TypeError('network error'));
      else return new Promise<void>(() => {});
      return undefined;
    },
  });
}

test('a status other than success is http-status, named', () => {
  const response = new Response('gone', { status: 404, statusText: 'Not Found' });
  assert.throws(() => checkHead(URL_, response), {
    code: 'http-status',
    message: /rose\.ltm .*404 Not Found/,
  });
});

test('a web page in the file’s place is http-type', () => {
  const response = new Response('<p>Log in', {
    headers: { 'content-type': 'text/html; charset=utf-8' },
  });
  assert.throws(() => checkHead(URL_, response), { code: 'http-type', message: /text\/html/ });
});

test('a length is believed only where no encoding hides the true one', () => {
  const head = (headers: Record<string, string>) =>
    checkHead(URL_, new Response(null, { headers }));
  assert.equal(head({ 'content-length': '42' }).bytes, 42);
  assert.equal(head({ 'content-length': '42', 'content-encoding': 'gzip' }).bytes, undefined);
  assert.equal(head({ 'content-length': 'many' }).bytes, undefined);
  assert.equal(head({}).bytes, undefined);
});

test('a server out of reach is http-network', async () => {
  const fetcher = () => Promise.reject(new TypeError('Failed to fetch'));
  await assert.rejects(request(URL_, never, fetcher), { code: 'http-network' });
});

test('an abort is an abort, not a network fault', async () => {
  const abort = new AbortController();
  const fetcher = () => {
    abort.abort(new Error('no longer wanted'));
    return Promise.reject(new TypeError('Failed to fetch'));
  };
  await assert.rejects(request(URL_, abort.signal, fetcher), /no longer wanted/);
});

test('a whole body comes through', async () => {
  const headers = { 'content-length': '30' };
  assert.equal(await drain(new Response(bodyOf([10, 20], 'ends'), { headers })), 30);
  assert.equal(await drain(new Response(bodyOf([10, 20], 'ends'))), 30);
  assert.equal(await drain(new Response(null)), 0);
});

test('a length that may count compressed bytes does not make a body short', async () => {
  const headers = { 'content-length': '50' };
  assert.equal(await drain(new Response(bodyOf([10, 20], 'ends'), { headers })), 30);
});

test('a body that is cut is http-short', async () => {
  await assert.rejects(drain(new Response(bodyOf([10, 20], 'fails')), 50), {
    code: 'http-short',
    message: /rose\.ltm .*30 of 50 bytes/,
  });
  await assert.rejects(drain(new Response(bodyOf([10], 'fails'))), {
    code: 'http-short',
    message: /after 10 bytes \(network error\)/,
  });
});

test('silence is http-stalled, before the head and within the body', async () => {
  const silent = () => new Promise<Response>(() => {});
  await assert.rejects(request(URL_, never, silent, 5), { code: 'http-stalled' });
  await assert.rejects(drain(new Response(bodyOf([10], 'hangs')), undefined, 5), {
    code: 'http-stalled',
  });
});

test('a file is called by the last part of its path', () => {
  assert.equal(nameOf(URL_), 'rose.ltm');
  assert.equal(nameOf('https://museum.example/'), 'museum.example');
});
