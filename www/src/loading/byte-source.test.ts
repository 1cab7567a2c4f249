import assert from 'node:assert/strict';
import { getEventListeners, once } from 'node:events';
import {
  createServer,
  type IncomingMessage,
  type OutgoingHttpHeaders,
  type ServerResponse,
} from 'node:http';
import type { AddressInfo } from 'node:net';
import test, { type TestContext } from 'node:test';
import { gzipSync } from 'node:zlib';
import type { ByteRange } from '../shared/byte-range.js';
import { HttpSource, type SourcePorts } from './byte-source.js';

const never = new AbortController().signal;

/** A file in which every place looks different. */
function fileOf(length: number): Buffer {
  const file = Buffer.alloc(length);
  for (let i = 0; i < length; i++) file[i] = (i * 31 + (i >> 8) * 17 + (i >> 16) * 7) & 255;
  return file;
}

function range(start: number, end: number): ByteRange {
  return { start, end };
}

/** The range that a request asks for. */
function askedOf(request: IncomingMessage): ByteRange | undefined {
  const parts = /^bytes=(\d+)-(\d+)$/.exec(request.headers.range ?? '');
  return parts ? range(Number(parts[1]), Number(parts[2]) + 1) : undefined;
}

interface Answering {
  readonly headers?: OutgoingHttpHeaders;
  /** Left out of the answer, as browsers leave it out for other origins. */
  readonly hideRange?: boolean;
  /** Bytes after which the connection breaks. */
  readonly breakAfter?: number;
}

/** Answers as servers do that know ranges. */
function answer(
  request: IncomingMessage,
  response: ServerResponse,
  file: Buffer,
  { headers = {}, hideRange = false, breakAfter }: Answering = {},
): void {
  const asked = askedOf(request);
  if (!asked) {
    response.writeHead(200, { 'content-length': file.length, ...headers });
    send(response, file, breakAfter);
    return;
  }
  const end = Math.min(asked.end, file.length);
  if (asked.start >= file.length) {
    response.writeHead(416, hideRange ? {} : { 'content-range': `bytes */${file.length}` });
    response.end();
    return;
  }
  const said = { 'content-range': `bytes ${asked.start}-${end - 1}/${file.length}` };
  const length = { 'content-length': end - asked.start };
  response.writeHead(206, { ...length, ...(hideRange ? {} : said), ...headers });
  send(response, file.subarray(asked.start, end), breakAfter);
}

/** Sends a body, or the beginning of it only. */
function send(response: ServerResponse, bytes: Buffer, breakAfter = bytes.length): void {
  if (breakAfter >= bytes.length) response.end(bytes);
  else response.write(bytes.subarray(0, breakAfter), () => response.socket?.destroySoon());
}

type Handler = (request: IncomingMessage, response: ServerResponse, count: number) => void;

interface Site {
  readonly url: string;
  /** What has been asked for, in order. */
  readonly asked: (string | undefined)[];
  readonly requests: IncomingMessage[];
}

/** A server of its own for a test. `count` is 1 with the first request. */
async function serve(t: TestContext, handler: Handler): Promise<Site> {
  const asked: (string | undefined)[] = [];
  const requests: IncomingMessage[] = [];
  const server = createServer((request, response) => {
    asked.push(request.headers.range?.replace('bytes=', ''));
    handler(request, response, requests.push(request));
  });
  server.listen(0, '127.0.0.1');
  await once(server, 'listening');
  t.after(() => {
    server.close();
    server.closeAllConnections();
  });
  const { port } = server.address() as AddressInfo;
  return { url: `http://127.0.0.1:${port}/windows/rose.ltm?v=2`, asked, requests };
}

interface Kit {
  readonly source: HttpSource;
  /** How long it waited between tries. */
  readonly pauses: number[];
}

/** A source that does not wait. */
function sourceOf(url: string, ports: Partial<SourcePorts> = {}): Kit {
  const pauses: number[] = [];
  const sleep = async (ms: number) => {
    pauses.push(ms);
  };
  const source = new HttpSource(url, { fetch, sleep, random: () => 0.5, ...ports });
  return { source, pauses };
}

/** What a reader has at last. */
class Copy {
  readonly bytes: Buffer;
  /** How often each byte came. */
  readonly times: Uint8Array;

  constructor(length: number) {
    this.bytes = Buffer.alloc(length);
    this.times = new Uint8Array(length);
  }

  async read(source: HttpSource, requested: ByteRange, signal = never): Promise<this> {
    for await (const { offset, bytes } of source.read(requested, signal)) {
      assert.ok(bytes.byteLength > 0 && offset + bytes.byteLength <= this.bytes.length);
      this.bytes.set(bytes, offset);
      for (let i = 0; i < bytes.byteLength; i++) (this.times[offset + i] as number)++;
    }
    return this;
  }

  /** Whether ranges, none of which overlap, have come and nothing else: each byte once and like the
   * file's. */
  has(file: Buffer, ...ranges: ByteRange[]): void {
    let missing = this.times.reduce((sum, times) => sum + times, 0);
    for (const { start, end } of ranges) {
      missing -= end - start;
      assert.ok(this.bytes.subarray(start, end).equals(file.subarray(start, end)), 'same bytes');
      assert.ok(
        this.times.subarray(start, end).every((times) => times === 1),
        'each once',
      );
    }
    assert.equal(missing, 0, 'nothing else');
  }
}

async function drain(source: HttpSource, requested: ByteRange, signal = never): Promise<void> {
  await new Copy(1 << 22).read(source, requested, signal);
}

test('a range comes with one request, of no header that other origins must allow', async (t) => {
  const file = fileOf(50_000);
  const site = await serve(t, (request, response) => answer(request, response, file));
  const { source } = sourceOf(site.url);
  assert.equal(source.size, undefined);
  const copy = await new Copy(50_000).read(source, range(1000, 31_000));
  copy.has(file, range(1000, 31_000));
  assert.deepEqual(site.asked, ['1000-30999']);
  const plain = ['host', 'connection', 'accept', 'accept-language', 'accept-encoding'];
  const own = Object.keys(site.requests[0]?.headers ?? {}).filter(
    (name) => !plain.includes(name) && !name.startsWith('sec-') && name !== 'user-agent',
  );
  assert.deepEqual(own, ['range']);
  assert.equal(source.size, 50_000);
});

test('a range may reach beyond the end of a file, of which nothing is known yet', async (t) => {
  const file = fileOf(5000);
  const site = await serve(t, (request, response) => answer(request, response, file));
  const { source } = sourceOf(site.url);
  const copy = await new Copy(5000).read(source, range(0, 16_384));
  copy.has(file, range(0, 5000));
  assert.deepEqual(site.asked, ['0-16383']);
  assert.equal(source.size, 5000);
});

test('a file without its size in sight is read to its end', async (t) => {
  const file = fileOf(5000);
  const site = await serve(t, (request, response) =>
    answer(request, response, file, { hideRange: true }),
  );
  const { source, pauses } = sourceOf(site.url);
  (await new Copy(5000).read(source, range(0, 16_384))).has(file, range(0, 5000));
  assert.deepEqual(site.asked, ['0-16383', '5000-16383']);
  assert.deepEqual(pauses, []);
  assert.equal(source.size, 5000);
});

test('pieces are handed over as they arrive', async (t) => {
  const file = fileOf(1000);
  let more = () => {};
  const site = await serve(t, (_, response) => {
    response.writeHead(206, { 'content-range': 'bytes 0-999/1000' });
    response.write(file.subarray(0, 300));
    more = () => response.end(file.subarray(300));
  });
  const { source } = sourceOf(site.url);
  const pieces = source.read(range(0, 1000), never);
  const first = (await pieces.next()).value;
  assert.equal(first?.bytes.byteLength, 300);
  more();
  const second = (await pieces.next()).value;
  assert.deepEqual([second?.offset, second?.bytes.byteLength], [300, 700]);
  assert.ok((await pieces.next()).done);
});

test('nothing wanted, nothing asked', async (t) => {
  const site = await serve(t, (_, response) => response.end());
  const { source } = sourceOf(site.url);
  await drain(source, range(0, 0));
  await drain(source, range(7, 7));
  assert.equal(site.asked.length, 0);
});

/** Reads two ranges from answers with these headers, one after the other. */
async function readTwice(
  t: TestContext,
  first: OutgoingHttpHeaders,
  second: OutgoingHttpHeaders,
  lengths: [number, number] = [5000, 5000],
): Promise<void> {
  const site = await serve(t, (request, response, count) =>
    answer(request, response, fileOf(lengths[count - 1] ?? 0), {
      headers: count === 1 ? first : second,
    }),
  );
  const { source } = sourceOf(site.url);
  await drain(source, range(0, 100));
  await drain(source, range(1000, 1100));
}

test('a file that was replaced is http-changed', async (t) => {
  const changed = { code: 'http-changed', message: /rose\.ltm was replaced on the server/ };
  const [then, later] = ['Mon, 01 Jan 2024 00:00:00 GMT', 'Tue, 02 Jan 2024 00:00:00 GMT'];
  await assert.rejects(readTwice(t, { etag: '"a"' }, { etag: '"b"' }), changed);
  await assert.rejects(readTwice(t, {}, {}, [5000, 5001]), changed);
  await assert.rejects(readTwice(t, { etag: '"a"' }, { etag: '"a"' }, [5000, 500]), changed);
  await assert.rejects(
    readTwice(t, { etag: 'W/"a"', 'last-modified': then }, { 'last-modified': later }),
    changed,
  );
  // Servers' clocks may differ while the bytes are the same, and weak tags say nothing.
  await readTwice(
    t,
    { etag: '"a"', 'last-modified': then },
    { etag: '"a"', 'last-modified': later },
  );
  await readTwice(t, { etag: 'W/"a"', 'last-modified': then }, { etag: 'W/"b"' });
});

test('a file that was replaced while a transfer was broken off is http-changed', async (t) => {
  const site = await serve(t, (request, response, count) => {
    const headers = { etag: `"${count}"` };
    answer(request, response, fileOf(5000), { headers, breakAfter: 1000 });
  });
  const { source } = sourceOf(site.url);
  await assert.rejects(drain(source, range(0, 4000)), { code: 'http-changed' });
  assert.equal(site.asked.length, 2);
});

test('a server that knows no ranges is read from start to end, once', async (t) => {
  const file = fileOf(40_000);
  const site = await serve(t, (_, response) => {
    response.writeHead(200, { 'content-length': file.length });
    response.end(file);
  });
  const { source } = sourceOf(site.url);
  const copy = await new Copy(40_000).read(source, range(10_000, 10_100));
  copy.has(file, range(0, 40_000));
  assert.equal(source.size, 40_000);
  await copy.read(source, range(0, 40_000));
  copy.has(file, range(0, 40_000));
  assert.equal(site.asked.length, 1);
  await assert.rejects(drain(source, range(39_000, 41_000)), {
    code: 'format-truncated',
    message: /rose\.ltm is too short: bytes 39000 to 40999 .* only 40000/,
  });
});

test('a server that compresses on its way sends the whole file', async (t) => {
  const file = fileOf(40_000);
  const site = await serve(t, (_, response) => {
    response.writeHead(200, { 'content-encoding': 'gzip', etag: '"a-gzip"' });
    response.end(gzipSync(file));
  });
  const { source } = sourceOf(site.url);
  (await new Copy(40_000).read(source, range(0, 100))).has(file, range(0, 40_000));
  assert.equal(source.size, 40_000);
  (await new Copy(40_000).read(source, range(100, 40_000))).has(file);
  assert.equal(site.asked.length, 1);
  // Nothing but the end of the transfer has told how long the file is.
  await assert.rejects(drain(source, range(40_000, 41_000)), {
    code: 'http-short',
    message: /rose\.ltm is incomplete: .* at byte 40000, before byte 41000/,
  });
});

test('the tag of a compressed file is not taken for another file’s', async (t) => {
  const file = fileOf(5000);
  const site = await serve(t, (request, response, count) => {
    if (count === 1) return answer(request, response, file, { headers: { etag: '"a"' } });
    response.writeHead(200, { 'content-encoding': 'gzip', etag: '"a-gzip"' });
    response.end(gzipSync(file));
  });
  const { source } = sourceOf(site.url);
  await drain(source, range(0, 100));
  const copy = await new Copy(5000).read(source, range(100, 200));
  copy.has(file, range(0, 5000));
});

test('a whole file that is longer than the file it was is http-changed', async (t) => {
  const site = await serve(t, (request, response, count) => {
    if (count === 1) return answer(request, response, fileOf(5000));
    response.writeHead(200, { 'content-encoding': 'gzip' });
    response.end(gzipSync(fileOf(6000)));
  });
  const { source } = sourceOf(site.url);
  await drain(source, range(0, 100));
  await assert.rejects(drain(source, range(100, 200)), { code: 'http-changed' });
});

test('a whole file that breaks off goes on where it ended', async (t) => {
  const file = fileOf(40_000);
  const site = await serve(t, (_, response, count) => {
    response.writeHead(200, { 'content-length': file.length, etag: '"a"' });
    send(response, file, count * 15_000);
  });
  const { source, pauses } = sourceOf(site.url);
  (await new Copy(40_000).read(source, range(0, 100))).has(file, range(0, 40_000));
  assert.deepEqual(site.asked, ['0-99', undefined, undefined]);
  assert.equal(pauses.length, 2);
});

test('a whole file that always breaks off at the same place is http-short', async (t) => {
  const site = await serve(t, (_, response) => {
    response.writeHead(200, { 'content-length': 40_000 });
    send(response, fileOf(40_000), 15_000);
  });
  const { source } = sourceOf(site.url);
  await assert.rejects(drain(source, range(0, 100)), {
    code: 'http-short',
    message: /at byte 15000, before byte 40000/,
  });
  assert.equal(site.asked.length, 5);
});

test('who stops early ends the transfer, and gets the rest of a whole file later', async (t) => {
  const file = fileOf(4_000_000);
  const closed: Promise<unknown>[] = [];
  const site = await serve(t, (_, response) => {
    closed.push(once(response, 'close'));
    response.writeHead(200, { 'content-length': file.length });
    response.end(file);
  });
  const { source } = sourceOf(site.url);
  const copy = new Copy(4_000_000);
  for await (const { offset, bytes } of source.read(range(0, 100), never)) {
    copy.bytes.set(bytes, offset);
    copy.times.fill(1, offset, offset + bytes.byteLength);
    if (offset > 100_000) break;
  }
  await Promise.all(closed);
  await copy.read(source, range(0, 100));
  copy.has(file, range(0, 4_000_000));
  assert.equal(site.asked.length, 2);
});

test('an empty file has nothing that could be wanted', async (t) => {
  const whole = await serve(t, (_, response) => response.end());
  await assert.rejects(drain(sourceOf(whole.url).source, range(0, 100)), {
    message: /rose\.ltm/,
  });
  const ranges = await serve(t, (request, response) => answer(request, response, fileOf(0)));
  await assert.rejects(drain(sourceOf(ranges.url).source, range(0, 100)), {
    code: 'format-truncated',
    message: /rose\.ltm is too short: bytes 0 to 99 are needed, but the server has only 0\./,
  });
});

test('compressed parts are http-encoding', async (t) => {
  const site = await serve(t, (request, response) =>
    answer(request, response, fileOf(5000), { headers: { 'content-encoding': 'br' } }),
  );
  await assert.rejects(drain(sourceOf(site.url).source, range(0, 100)), {
    code: 'http-encoding',
    message: /rose\.ltm cannot be read in parts, .* compresses it \(br\).* without compression/,
  });
  const plain = await serve(t, (request, response) =>
    answer(request, response, fileOf(5000), { headers: { 'content-encoding': 'identity' } }),
  );
  await drain(sourceOf(plain.url).source, range(0, 100));
});

test('a file that is too short is format-truncated', async (t) => {
  const file = fileOf(5000);
  const site = await serve(t, (request, response) => answer(request, response, file));
  const tooShort = {
    code: 'format-truncated',
    message: /rose\.ltm is too short: bytes 8000 to 8999 are needed, .* has only 5000/,
  };
  const { source } = sourceOf(site.url);
  await assert.rejects(drain(source, range(8000, 9000)), tooShort);
  assert.equal(source.size, 5000);
  await assert.rejects(drain(source, range(8000, 9000)), tooShort);
  await assert.rejects(drain(source, range(4000, 5001)), { code: 'format-truncated' });
  assert.equal(site.asked.length, 1, 'what is known needs no request');

  const { source: mute } = sourceOf(
    (await serve(t, (_, response) => response.writeHead(416).end())).url,
  );
  await assert.rejects(drain(mute, range(8000, 9000)), {
    code: 'http-range',
    message: /rose\.ltm could not be loaded: .* no bytes 8000 to 8999/,
  });
});

test('what is there still comes after the error of a range beyond the end', async (t) => {
  const file = fileOf(5000);
  const site = await serve(t, (request, response) => answer(request, response, file));
  const { source } = sourceOf(site.url);
  const copy = await new Copy(5000).read(source, range(0, 1000));
  await assert.rejects(copy.read(source, range(8000, 9000)), { code: 'format-truncated' });
  await copy.read(source, range(4000, 4500));
  copy.has(file, range(0, 1000), range(4000, 4500));
  assert.deepEqual(site.asked, ['0-999', '4000-4499']);
});

test('a transfer that breaks off goes on where it ended', async (t) => {
  const file = fileOf(50_000);
  const site = await serve(t, (request, response, count) =>
    answer(request, response, file, count < 4 ? { breakAfter: 10_000 } : {}),
  );
  const { source, pauses } = sourceOf(site.url, { maxRetries: 1 });
  (await new Copy(50_000).read(source, range(5000, 45_000))).has(file, range(5000, 45_000));
  assert.deepEqual(site.asked, ['5000-44999', '15000-44999', '25000-44999', '35000-44999']);
  assert.deepEqual(pauses, [187.5, 187.5, 187.5], 'no longer, as each brought something');
});

test('a body that ends early without a word is asked for again', async (t) => {
  const file = fileOf(1000);
  const site = await serve(t, (request, response, count) => {
    if (count > 1) return answer(request, response, file);
    response.writeHead(206, { 'content-range': 'bytes 0-999/1000' });
    response.end(file.subarray(0, 400));
  });
  const { source, pauses } = sourceOf(site.url);
  (await new Copy(1000).read(source, range(0, 1000))).has(file, range(0, 1000));
  assert.deepEqual(site.asked, ['0-999', '400-999']);
  assert.equal(pauses.length, 1);
});

test('a server that sends less than was asked for, and says so, is asked for the rest', async (t) => {
  const file = fileOf(1000);
  const site = await serve(t, (request, response) => {
    const { start, end } = askedOf(request) ?? range(0, 0);
    request.headers.range = `bytes=${start}-${Math.min(end, start + 300) - 1}`;
    answer(request, response, file);
  });
  const { source, pauses } = sourceOf(site.url);
  (await new Copy(1000).read(source, range(0, 1000))).has(file, range(0, 1000));
  assert.equal(site.asked.length, 4);
  assert.deepEqual(pauses, []);
});

test('empty answers are not asked for forever', async (t) => {
  const site = await serve(t, (_, response) => {
    response.writeHead(206, { 'content-length': 0 }).end();
  });
  await assert.rejects(drain(sourceOf(site.url).source, range(0, 100)), { code: 'http-short' });
  assert.equal(site.asked.length, 5);
});

test('faults that may pass are waited out, longer each time', async (t) => {
  const file = fileOf(1000);
  const statuses = [408, 425, 429, 500, 502, 503, 504];
  const site = await serve(t, (request, response, count) => {
    const status = statuses[count - 1];
    if (status) response.writeHead(status, { 'content-type': 'text/html' }).end('<p>Busy');
    else answer(request, response, file);
  });
  const { source, pauses } = sourceOf(site.url, { maxRetries: 7 });
  (await new Copy(1000).read(source, range(0, 1000))).has(file, range(0, 1000));
  assert.deepEqual(pauses, [187.5, 375, 750, 1500, 3000, 6000, 6000]);
});

test('a server’s wish to be left alone for some time is heard', async (t) => {
  const now = Date.UTC(2026, 0, 1);
  const wishes = ['3', new Date(now + 5000).toUTCString(), '86400', 'soon', '0'];
  const site = await serve(t, (request, response, count) => {
    const wish = wishes[count - 1];
    if (wish) response.writeHead(503, { 'retry-after': wish }).end();
    else answer(request, response, fileOf(1000));
  });
  const { source, pauses } = sourceOf(site.url, { now: () => now, maxRetries: 5 });
  await drain(source, range(0, 1000));
  assert.deepEqual(pauses, [3000, 5000, 30_000, 1500, 3000]);
});

test('faults that do not pass end in an error that says so', async (t) => {
  const site = await serve(t, (_, response) => response.writeHead(503).end());
  const { source, pauses } = sourceOf(site.url);
  await assert.rejects(drain(source, range(0, 1000)), {
    name: 'PhotoError',
    code: 'http-status',
    message: /rose\.ltm could not be loaded: .* 503 Service Unavailable\. It was tried 5 times\./,
  });
  assert.equal(pauses.length, 4);
});

test('a server out of reach is http-network', async () => {
  const server = createServer().listen(0, '127.0.0.1');
  await once(server, 'listening');
  const { port } = server.address() as AddressInfo;
  server.close();
  await once(server, 'close');
  const { source, pauses } = sourceOf(`http://127.0.0.1:${port}/rose.ltm`);
  await assert.rejects(drain(source, range(0, 1000)), {
    code: 'http-network',
    message: /^rose\.ltm could not be fetched/,
  });
  assert.equal(pauses.length, 4);
});

/** A browser's `fetch` that lets no answer through where a part was asked for; counts what it is asked. */
function withoutParts(asked: string[]): typeof fetch {
  return (input, init) => {
    asked.push(init?.headers ? 'part' : 'whole');
    return init?.headers ? Promise.reject(new TypeError('Failed to fetch')) : fetch(input, init);
  };
}

test('a browser that does not let parts through is given the whole file', async (t) => {
  const file = fileOf(40_000);
  const site = await serve(t, (_, response) => {
    response.writeHead(200, { 'content-encoding': 'gzip' });
    response.end(gzipSync(file));
  });
  const tries: string[] = [];
  const { source, pauses } = sourceOf(site.url, { fetch: withoutParts(tries) });
  (await new Copy(40_000).read(source, range(0, 100))).has(file, range(0, 40_000));
  assert.deepEqual(tries, ['part', 'part', 'whole']);
  assert.equal(pauses.length, 2);
  await drain(source, range(30_000, 40_000));
  assert.equal(tries.length, 3);
});

test('a whole file that breaks off is not asked for in parts that nobody lets through', async (t) => {
  const file = fileOf(40_000);
  const site = await serve(t, (_, response, count) => {
    response.writeHead(200, { 'content-length': file.length });
    send(response, file, count * 15_000);
  });
  const tries: string[] = [];
  const { source } = sourceOf(site.url, { fetch: withoutParts(tries) });
  (await new Copy(40_000).read(source, range(0, 100))).has(file, range(0, 40_000));
  assert.deepEqual(tries, ['part', 'part', 'whole', 'whole', 'whole']);
});

test('a server that has answered once is asked for parts only', async (t) => {
  const file = fileOf(5000);
  const site = await serve(t, (request, response, count) => {
    if (count > 1 && count < 5) response.socket?.destroy();
    else answer(request, response, file);
  });
  const { source } = sourceOf(site.url);
  await drain(source, range(0, 100));
  await drain(source, range(200, 300));
  assert.deepEqual(site.asked, ['0-99', ...Array(4).fill('200-299')]);
});

test('other statuses are http-status at once', async (t) => {
  for (const status of [404, 403, 204]) {
    const site = await serve(t, (_, response) => response.writeHead(status).end());
    await assert.rejects(drain(sourceOf(site.url).source, range(0, 1000)), {
      code: 'http-status',
      message: new RegExp(`rose\\.ltm .* answered ${status}`),
    });
    assert.equal(site.asked.length, 1);
  }
});

test('a web page in the file’s place is http-type', async (t) => {
  const headers = { 'content-type': 'text/html; charset=utf-8' };
  const whole = await serve(t, (_, response) => response.writeHead(200, headers).end('<p>Log in'));
  const wrong = { code: 'http-type', message: /rose\.ltm .* web page \(text\/html\)/ };
  await assert.rejects(drain(sourceOf(whole.url).source, range(0, 1000)), wrong);
  const part = await serve(t, (request, response) =>
    answer(request, response, fileOf(1000), { headers }),
  );
  await assert.rejects(drain(sourceOf(part.url).source, range(0, 1000)), wrong);
});

test('another part than was asked for is http-range', async (t) => {
  const wrong: OutgoingHttpHeaders[] = [
    { 'content-range': 'bytes 0-99/5000' },
    { 'content-range': 'bytes 100-300/5000' },
    { 'content-range': 'bytes 100-99/5000' },
    { 'content-range': 'bytes 100-199/150' },
    { 'content-range': 'none' },
    { 'content-length': 5000 },
    { 'content-type': 'multipart/byteranges; boundary=x' },
    { 'transfer-encoding': 'chunked' },
  ];
  for (const headers of wrong) {
    const site = await serve(t, (_, response) => {
      response.writeHead(206, headers);
      response.end(fileOf(5000));
    });
    await assert.rejects(
      drain(sourceOf(site.url).source, range(100, 200)),
      { code: 'http-range', message: /rose\.ltm .* bytes 100 to 199 .* the server sent others/ },
      JSON.stringify(headers),
    );
    assert.equal(site.asked.length, 1);
  }
});

test('silence is waited out only so long, before the head and within the body', async (t) => {
  const file = fileOf(1000);
  const site = await serve(t, (request, response, count) => {
    if (count === 1) return;
    if (count === 3) return answer(request, response, file);
    response.writeHead(206, { 'content-range': 'bytes 0-999/1000' });
    response.write(file.subarray(0, 100));
  });
  const { source } = sourceOf(site.url, { stallMs: 150 });
  (await new Copy(1000).read(source, range(0, 1000))).has(file, range(0, 1000));
  assert.deepEqual(site.asked, ['0-999', '0-999', '100-999']);

  const closed: Promise<unknown>[] = [];
  const silent = await serve(t, (_, response) => closed.push(once(response, 'close')));
  const { source: stuck } = sourceOf(silent.url, { stallMs: 10, maxRetries: 1 });
  await assert.rejects(drain(stuck, range(0, 1000)), {
    code: 'http-stalled',
    message: /rose\.ltm could not be loaded: no data arrived for \d+ seconds\. .* 2 times/,
  });
  await Promise.all(closed);
});

/** Aborts a read when told to, and makes sure that nothing of it is left. */
async function abortWhen(
  t: TestContext,
  handler: (response: ServerResponse, abort: () => void) => void,
  ports: (abort: () => void) => Partial<SourcePorts> = () => ({}),
): Promise<void> {
  const controller = new AbortController();
  const reason = new Error('no longer renderOptions');
  const abort = () => controller.abort(reason);
  const closed: Promise<unknown>[] = [];
  const site = await serve(t, (_, response) => {
    closed.push(once(response, 'close'));
    handler(response, abort);
  });
  const { source } = sourceOf(site.url, ports(abort));
  const { signal } = controller;
  await assert.rejects(drain(source, range(0, 1000), signal), (thrown) => thrown === reason);
  assert.equal(getEventListeners(signal, 'abort').length, 0);
  await Promise.all(closed);
  await assert.rejects(drain(source, range(0, 1000), signal), (thrown) => thrown === reason);
}

test('an abort ends every wait at once, with its reason', async (t) => {
  // For the head.
  await abortWhen(t, (_, abort) => setTimeout(abort, 5));
  // For the body.
  await abortWhen(t, (response, abort) => {
    response.writeHead(206, { 'content-length': 500 });
    response.write(fileOf(100));
    setTimeout(abort, 5);
  });
  // For another try, even where the port itself does not listen.
  await abortWhen(
    t,
    (response) => response.writeHead(503).end(),
    (abort) => ({
      sleep: () => {
        setTimeout(abort, 5);
        return new Promise(() => {});
      },
    }),
  );
});

test('an abort ends the wait of a fetch that does not listen', async () => {
  const controller = new AbortController();
  const { source } = sourceOf('rose.ltm', { fetch: () => new Promise(() => {}) });
  setTimeout(() => controller.abort(new Error('no longer renderOptions')), 5);
  await assert.rejects(drain(source, range(0, 10), controller.signal), /no longer renderOptions/);
});

test('an abort between two pieces is noticed with the next', async (t) => {
  const closed: Promise<unknown>[] = [];
  const site = await serve(t, (request, response) => {
    closed.push(once(response, 'close'));
    answer(request, response, fileOf(4_000_000));
  });
  const controller = new AbortController();
  const { source } = sourceOf(site.url);
  const pieces = source.read(range(0, 4_000_000), controller.signal);
  await pieces.next();
  controller.abort(new Error('no longer renderOptions'));
  await Promise.all(closed);
  await assert.rejects(pieces.next(), /no longer renderOptions/);
  assert.equal(getEventListeners(controller.signal, 'abort').length, 0);
});

test('an abort is noticed where the rest is there already, and no one else listens', async () => {
  const body = new ReadableStream<Uint8Array>({
    start: (stream) => {
      stream.enqueue(fileOf(100));
      stream.enqueue(fileOf(100));
      stream.close();
    },
  });
  const headers = { 'content-range': 'bytes 0-199/200' };
  const { source } = sourceOf('rose.ltm', {
    fetch: async () => new Response(body, { status: 206, headers }),
  });
  const controller = new AbortController();
  const pieces = source.read(range(0, 200), controller.signal);
  await pieces.next();
  controller.abort(new Error('no longer renderOptions'));
  await assert.rejects(pieces.next(), /no longer renderOptions/);
});

test('who stops early leaves no listener', async (t) => {
  const closed: Promise<unknown>[] = [];
  const site = await serve(t, (request, response) => {
    closed.push(once(response, 'close'));
    answer(request, response, fileOf(4_000_000));
  });
  const { signal } = new AbortController();
  const { source } = sourceOf(site.url);
  for await (const _ of source.read(range(0, 4_000_000), signal)) break;
  assert.equal(closed.length, 1);
  await Promise.all(closed);
  assert.equal(getEventListeners(signal, 'abort').length, 0);
});

test('an error ends the transfer, whatever its body still brings', async (t) => {
  const closed: Promise<unknown>[] = [];
  const site = await serve(t, (_, response) => {
    closed.push(once(response, 'close'));
    response.writeHead(404).write('…');
  });
  const { source } = sourceOf(site.url);
  await assert.rejects(drain(source, range(0, 100)), { code: 'http-status' });
  await Promise.all(closed);
});

test('the port’s own pause ends with the abort', async (t) => {
  const site = await serve(t, (_, response) =>
    response.writeHead(503, { 'retry-after': '20' }).end(),
  );
  const controller = new AbortController();
  const source = new HttpSource(site.url, { fetch });
  setTimeout(() => controller.abort(new Error('no longer renderOptions')), 50);
  await assert.rejects(drain(source, range(0, 10), controller.signal), /no longer renderOptions/);
  assert.equal(site.asked.length, 1);
});

test('whatever happens on the way, the bytes are the file’s', async (t) => {
  const file = fileOf(200_000);
  let seed = 7;
  const random = (below: number) => {
    seed = (seed * 48_271) % 2_147_483_647;
    return seed % below;
  };
  const site = await serve(t, (request, response) => {
    const fate = random(6);
    if (fate === 0) response.writeHead(503).end();
    else if (fate === 1) response.socket?.destroy();
    else {
      const breakAfter = fate === 2 ? random(3000) : file.length;
      answer(request, response, file, { headers: { etag: '"a"' }, breakAfter });
    }
  });
  for (let round = 0; round < 20; round++) {
    const { source } = sourceOf(site.url, { maxRetries: 30 });
    const renderOptions = Array.from({ length: 8 }, (_, i) => {
      const start = i * 25_000 + random(10_000);
      return range(start, start + random(15_000));
    }).sort(() => random(3) - 1);
    const copy = new Copy(200_000);
    for (const each of renderOptions) await copy.read(source, each);
    // All of it where nothing was heard at first; else the last byte is not wanted.
    copy.has(file, ...(copy.times.at(-1) ? [range(0, 200_000)] : renderOptions));
  }
});
