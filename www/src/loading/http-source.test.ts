import assert from 'node:assert/strict';
import { once } from 'node:events';
import type { OutgoingHttpHeaders } from 'node:http';
import test, { type TestContext } from 'node:test';
import { gzipSync } from 'node:zlib';
import {
  createSource,
  drain,
  fileOf,
  never,
  ReceivedFile,
  range,
  respond,
  sendBody,
  serve,
} from './http-fakes.js';

test('a range takes one request, without headers that need a CORS permission', async (t) => {
  const file = fileOf(50_000);
  const server = await serve(t, (request, response) => respond(request, response, file));
  const { source } = createSource(server.url);
  assert.equal(source.size, undefined);
  const received = await new ReceivedFile(50_000).read(source, range(1000, 31_000));
  received.assertEqual(file, range(1000, 31_000));
  assert.deepEqual(server.ranges, ['1000-30999']);
  const plain = ['host', 'connection', 'accept', 'accept-language', 'accept-encoding'];
  const own = Object.keys(server.requests[0]?.headers ?? {}).filter(
    (name) => !plain.includes(name) && !name.startsWith('sec-') && name !== 'user-agent',
  );
  assert.deepEqual(own, ['range']);
  assert.equal(source.size, 50_000);
});

test('the first range may exceed the file', async (t) => {
  const file = fileOf(5000);
  const server = await serve(t, (request, response) => respond(request, response, file));
  const { source } = createSource(server.url);
  const received = await new ReceivedFile(5000).read(source, range(0, 16_384));
  received.assertEqual(file, range(0, 5000));
  assert.deepEqual(server.ranges, ['0-16383']);
  assert.equal(source.size, 5000);
});

test('a file of unknown size is read to its end', async (t) => {
  const file = fileOf(5000);
  const server = await serve(t, (request, response) =>
    respond(request, response, file, { hideRange: true }),
  );
  const { source, pauses } = createSource(server.url);
  (await new ReceivedFile(5000).read(source, range(0, 16_384))).assertEqual(file, range(0, 5000));
  assert.deepEqual(server.ranges, ['0-16383', '5000-16383']);
  assert.deepEqual(pauses, []);
  assert.equal(source.size, 5000);
});

test('pieces are yielded as they arrive', async (t) => {
  const file = fileOf(1000);
  let more = () => {};
  const server = await serve(t, (_, response) => {
    response.writeHead(206, { 'content-range': 'bytes 0-999/1000' });
    response.write(file.subarray(0, 300));
    more = () => response.end(file.subarray(300));
  });
  const { source } = createSource(server.url);
  const pieces = source.read(range(0, 1000), never);
  const first = (await pieces.next()).value;
  assert.equal(first?.bytes.byteLength, 300);
  more();
  const second = (await pieces.next()).value;
  assert.deepEqual([second?.offset, second?.bytes.byteLength], [300, 700]);
  assert.ok((await pieces.next()).done);
});

test('an empty range sends no request', async (t) => {
  const server = await serve(t, (_, response) => response.end());
  const { source } = createSource(server.url);
  await drain(source, range(0, 0));
  await drain(source, range(7, 7));
  assert.equal(server.ranges.length, 0);
});

/** Reads two ranges from responses with these headers. */
async function readTwice(
  t: TestContext,
  first: OutgoingHttpHeaders,
  second: OutgoingHttpHeaders,
  lengths: [number, number] = [5000, 5000],
): Promise<void> {
  const server = await serve(t, (request, response, count) =>
    respond(request, response, fileOf(lengths[count - 1] ?? 0), {
      headers: count === 1 ? first : second,
    }),
  );
  const { source } = createSource(server.url);
  await drain(source, range(0, 100));
  await drain(source, range(1000, 1100));
}

test('a file that was replaced is http-changed', async (t) => {
  const changed = { code: 'http-changed', message: /rose\.ltm was replaced on the server/ };
  const [date, laterDate] = ['Mon, 01 Jan 2024 00:00:00 GMT', 'Tue, 02 Jan 2024 00:00:00 GMT'];
  await assert.rejects(readTwice(t, { etag: '"a"' }, { etag: '"b"' }), changed);
  await assert.rejects(readTwice(t, {}, {}, [5000, 5001]), changed);
  await assert.rejects(readTwice(t, { etag: '"a"' }, { etag: '"a"' }, [5000, 500]), changed);
  await assert.rejects(
    readTwice(t, { etag: 'W/"a"', 'last-modified': date }, { 'last-modified': laterDate }),
    changed,
  );
  // A strong tag decides whatever the dates are; a weak one is ignored.
  await readTwice(
    t,
    { etag: '"a"', 'last-modified': date },
    { etag: '"a"', 'last-modified': laterDate },
  );
  await readTwice(t, { etag: 'W/"a"', 'last-modified': date }, { etag: 'W/"b"' });
});

test('a file that was replaced during an interruption is http-changed', async (t) => {
  const server = await serve(t, (request, response, count) => {
    const headers = { etag: `"${count}"` };
    respond(request, response, fileOf(5000), { headers, breakAfter: 1000 });
  });
  const { source } = createSource(server.url);
  await assert.rejects(drain(source, range(0, 4000)), { code: 'http-changed' });
  assert.equal(server.ranges.length, 2);
});

test('a server without ranges sends the whole file once', async (t) => {
  const file = fileOf(40_000);
  const server = await serve(t, (_, response) => {
    response.writeHead(200, { 'content-length': file.length });
    response.end(file);
  });
  const { source } = createSource(server.url);
  const received = await new ReceivedFile(40_000).read(source, range(10_000, 10_100));
  received.assertEqual(file, range(0, 40_000));
  assert.equal(source.size, 40_000);
  await received.read(source, range(0, 40_000));
  received.assertEqual(file, range(0, 40_000));
  assert.equal(server.ranges.length, 1);
  await assert.rejects(drain(source, range(39_000, 41_000)), {
    code: 'format-truncated',
    message: /rose\.ltm is too short: bytes 39000 to 40999 .* only 40000/,
  });
});

test('a server that compresses sends the whole file', async (t) => {
  const file = fileOf(40_000);
  const server = await serve(t, (_, response) => {
    response.writeHead(200, { 'content-encoding': 'gzip', etag: '"a-gzip"' });
    response.end(gzipSync(file));
  });
  const { source } = createSource(server.url);
  (await new ReceivedFile(40_000).read(source, range(0, 100))).assertEqual(file, range(0, 40_000));
  assert.equal(source.size, 40_000);
  (await new ReceivedFile(40_000).read(source, range(100, 40_000))).assertEqual(file);
  assert.equal(server.ranges.length, 1);
  // Only the end of the transfer tells the size of the file.
  await assert.rejects(drain(source, range(40_000, 41_000)), {
    code: 'http-short',
    message: /rose\.ltm is incomplete: .* at byte 40000, before byte 41000/,
  });
});

test('the entity tag of a compressed file is ignored', async (t) => {
  const file = fileOf(5000);
  const server = await serve(t, (request, response, count) => {
    if (count === 1) return respond(request, response, file, { headers: { etag: '"a"' } });
    response.writeHead(200, { 'content-encoding': 'gzip', etag: '"a-gzip"' });
    response.end(gzipSync(file));
  });
  const { source } = createSource(server.url);
  await drain(source, range(0, 100));
  const received = await new ReceivedFile(5000).read(source, range(100, 200));
  received.assertEqual(file, range(0, 5000));
});

test('a whole file that is longer than the known size is http-changed', async (t) => {
  const server = await serve(t, (request, response, count) => {
    if (count === 1) return respond(request, response, fileOf(5000));
    response.writeHead(200, { 'content-encoding': 'gzip' });
    response.end(gzipSync(fileOf(6000)));
  });
  const { source } = createSource(server.url);
  await drain(source, range(0, 100));
  await assert.rejects(drain(source, range(100, 200)), { code: 'http-changed' });
});

test('an interrupted whole file continues where it ended', async (t) => {
  const file = fileOf(40_000);
  const server = await serve(t, (_, response, count) => {
    response.writeHead(200, { 'content-length': file.length, etag: '"a"' });
    sendBody(response, file, count * 15_000);
  });
  const { source, pauses } = createSource(server.url);
  (await new ReceivedFile(40_000).read(source, range(0, 100))).assertEqual(file, range(0, 40_000));
  assert.deepEqual(server.ranges, ['0-99', undefined, undefined]);
  assert.equal(pauses.length, 2);
});

test('a whole file that always ends at the same byte is http-short', async (t) => {
  const server = await serve(t, (_, response) => {
    response.writeHead(200, { 'content-length': 40_000 });
    sendBody(response, fileOf(40_000), 15_000);
  });
  const { source } = createSource(server.url);
  await assert.rejects(drain(source, range(0, 100)), {
    code: 'http-short',
    message: /at byte 15000, before byte 40000/,
  });
  assert.equal(server.ranges.length, 5);
});

test('a reader that stops ends the transfer, and gets the rest of a whole file later', async (t) => {
  const file = fileOf(4_000_000);
  const closed: Promise<unknown>[] = [];
  const server = await serve(t, (_, response) => {
    closed.push(once(response, 'close'));
    response.writeHead(200, { 'content-length': file.length });
    response.end(file);
  });
  const { source } = createSource(server.url);
  const received = new ReceivedFile(4_000_000);
  for await (const { offset, bytes } of source.read(range(0, 100), never)) {
    received.bytes.set(bytes, offset);
    received.counts.fill(1, offset, offset + bytes.byteLength);
    if (offset > 100_000) break;
  }
  await Promise.all(closed);
  await received.read(source, range(0, 100));
  received.assertEqual(file, range(0, 4_000_000));
  assert.equal(server.ranges.length, 2);
});

test('an empty file is too short', async (t) => {
  const whole = await serve(t, (_, response) => response.end());
  await assert.rejects(drain(createSource(whole.url).source, range(0, 100)), {
    message: /rose\.ltm/,
  });
  const ranges = await serve(t, (request, response) => respond(request, response, fileOf(0)));
  await assert.rejects(drain(createSource(ranges.url).source, range(0, 100)), {
    code: 'format-truncated',
    message: /rose\.ltm is too short: bytes 0 to 99 are needed, but the server has only 0\./,
  });
});
