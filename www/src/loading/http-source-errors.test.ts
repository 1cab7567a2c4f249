import assert from 'node:assert/strict';
import { getEventListeners, once } from 'node:events';
import { createServer, type OutgoingHttpHeaders, type ServerResponse } from 'node:http';
import type { AddressInfo } from 'node:net';
import test, { type TestContext } from 'node:test';
import { gzipSync } from 'node:zlib';
import {
  createSource,
  drain,
  fileOf,
  ReceivedFile,
  range,
  requestedRange,
  respond,
  sendBody,
  serve,
} from './http-fakes.js';
import { HttpSource, type HttpSourcePorts } from './http-source.js';

test('compressed ranges are http-encoding', async (t) => {
  const server = await serve(t, (request, response) =>
    respond(request, response, fileOf(5000), { headers: { 'content-encoding': 'br' } }),
  );
  await assert.rejects(drain(createSource(server.url).source, range(0, 100)), {
    code: 'http-encoding',
    message: /rose\.ltm cannot be read in parts, .* compresses it \(br\).* without compression/,
  });
  const plain = await serve(t, (request, response) =>
    respond(request, response, fileOf(5000), { headers: { 'content-encoding': 'identity' } }),
  );
  await drain(createSource(plain.url).source, range(0, 100));
});

test('without a network a server that cannot be reached is offline at once', async (t) => {
  const { navigator } = globalThis;
  Object.defineProperty(globalThis, 'navigator', { value: { onLine: false }, configurable: true });
  t.after(() => {
    Object.defineProperty(globalThis, 'navigator', { value: navigator, configurable: true });
  });
  const lost = async () => {
    throw new TypeError('Failed to fetch');
  };
  const { source, pauses } = createSource('https://museum.example/rose.ltm', { fetch: lost });
  await assert.rejects(drain(source, range(0, 100)), { code: 'offline', message: /is offline/ });
  assert.deepEqual(pauses, []);
});

test('a file that is too short is format-truncated', async (t) => {
  const file = fileOf(5000);
  const server = await serve(t, (request, response) => respond(request, response, file));
  const tooShort = {
    code: 'format-truncated',
    message: /rose\.ltm is too short: bytes 8000 to 8999 are needed, .* has only 5000/,
  };
  const { source } = createSource(server.url);
  await assert.rejects(drain(source, range(8000, 9000)), tooShort);
  assert.equal(source.size, 5000);
  await assert.rejects(drain(source, range(8000, 9000)), tooShort);
  await assert.rejects(drain(source, range(4000, 5001)), { code: 'format-truncated' });
  assert.equal(server.ranges.length, 1, 'a known size needs no request');

  const { source: silentAboutSize } = createSource(
    (await serve(t, (_, response) => response.writeHead(416).end())).url,
  );
  await assert.rejects(drain(silentAboutSize, range(8000, 9000)), {
    code: 'http-range',
    message: /rose\.ltm could not be loaded: .* no bytes 8000 to 8999/,
  });
});

test('after an error of a range beyond the end, other ranges are read', async (t) => {
  const file = fileOf(5000);
  const server = await serve(t, (request, response) => respond(request, response, file));
  const { source } = createSource(server.url);
  const received = await new ReceivedFile(5000).read(source, range(0, 1000));
  await assert.rejects(received.read(source, range(8000, 9000)), { code: 'format-truncated' });
  await received.read(source, range(4000, 4500));
  received.assertEqual(file, range(0, 1000), range(4000, 4500));
  assert.deepEqual(server.ranges, ['0-999', '4000-4499']);
});

test('an interrupted transfer continues where it ended', async (t) => {
  const file = fileOf(50_000);
  const server = await serve(t, (request, response, count) =>
    respond(request, response, file, count < 4 ? { breakAfter: 10_000 } : {}),
  );
  const { source, pauses } = createSource(server.url, { maxRetries: 1 });
  (await new ReceivedFile(50_000).read(source, range(5000, 45_000))).assertEqual(
    file,
    range(5000, 45_000),
  );
  assert.deepEqual(server.ranges, ['5000-44999', '15000-44999', '25000-44999', '35000-44999']);
  assert.deepEqual(pauses, [187.5, 187.5, 187.5], 'no growth, because each attempt brought bytes');
});

test('the rest of a body that ends early is requested again', async (t) => {
  const file = fileOf(1000);
  const server = await serve(t, (request, response, count) => {
    if (count > 1) return respond(request, response, file);
    response.writeHead(206, { 'content-range': 'bytes 0-999/1000' });
    response.end(file.subarray(0, 400));
  });
  const { source, pauses } = createSource(server.url);
  (await new ReceivedFile(1000).read(source, range(0, 1000))).assertEqual(file, range(0, 1000));
  assert.deepEqual(server.ranges, ['0-999', '400-999']);
  assert.equal(pauses.length, 1);
});

test('the rest is requested if Content-Range is shorter than the range', async (t) => {
  const file = fileOf(1000);
  const server = await serve(t, (request, response) => {
    const { start, end } = requestedRange(request) ?? range(0, 0);
    request.headers.range = `bytes=${start}-${Math.min(end, start + 300) - 1}`;
    respond(request, response, file);
  });
  const { source, pauses } = createSource(server.url);
  (await new ReceivedFile(1000).read(source, range(0, 1000))).assertEqual(file, range(0, 1000));
  assert.equal(server.ranges.length, 4);
  assert.deepEqual(pauses, []);
});

test('empty responses end in an error', async (t) => {
  const server = await serve(t, (_, response) => {
    response.writeHead(206, { 'content-length': 0 }).end();
  });
  await assert.rejects(drain(createSource(server.url).source, range(0, 100)), {
    code: 'http-short',
  });
  assert.equal(server.ranges.length, 5);
});

test('retryable statuses are retried after growing pauses', async (t) => {
  const file = fileOf(1000);
  const statuses = [408, 425, 429, 500, 502, 503, 504];
  const server = await serve(t, (request, response, count) => {
    const status = statuses[count - 1];
    if (status) response.writeHead(status, { 'content-type': 'text/html' }).end('<p>Busy');
    else respond(request, response, file);
  });
  const { source, pauses } = createSource(server.url, { maxRetries: 7 });
  (await new ReceivedFile(1000).read(source, range(0, 1000))).assertEqual(file, range(0, 1000));
  assert.deepEqual(pauses, [187.5, 375, 750, 1500, 3000, 6000, 6000]);
});

test('Retry-After is respected', async (t) => {
  const now = Date.UTC(2026, 0, 1);
  const headers = ['3', new Date(now + 5000).toUTCString(), '86400', 'soon', '0'];
  const server = await serve(t, (request, response, count) => {
    const retryAfter = headers[count - 1];
    if (retryAfter) response.writeHead(503, { 'retry-after': retryAfter }).end();
    else respond(request, response, fileOf(1000));
  });
  const { source, pauses } = createSource(server.url, { now: () => now, maxRetries: 5 });
  await drain(source, range(0, 1000));
  assert.deepEqual(pauses, [3000, 5000, 30_000, 1500, 3000]);
});

test('the error after the last retry tells the number of attempts', async (t) => {
  const server = await serve(t, (_, response) => response.writeHead(503).end());
  const { source, pauses } = createSource(server.url);
  await assert.rejects(drain(source, range(0, 1000)), {
    name: 'PhotoError',
    code: 'http-status',
    message: /rose\.ltm could not be loaded: .* 503 Service Unavailable\. It was tried 5 times\./,
  });
  assert.equal(pauses.length, 4);
});

test('an unreachable server is http-network', async () => {
  const unreachable = createServer().listen(0, '127.0.0.1');
  await once(unreachable, 'listening');
  const { port } = unreachable.address() as AddressInfo;
  unreachable.close();
  await once(unreachable, 'close');
  const { source, pauses } = createSource(`http://127.0.0.1:${port}/rose.ltm`);
  await assert.rejects(drain(source, range(0, 1000)), {
    code: 'http-network',
    message: /^rose\.ltm could not be fetched/,
  });
  assert.equal(pauses.length, 4);
});

/** A `fetch` that blocks requests with a range, and logs the requests. */
function withoutRanges(requests: string[]): typeof fetch {
  return (input, init) => {
    requests.push(init?.headers ? 'range' : 'whole');
    return init?.headers ? Promise.reject(new TypeError('Failed to fetch')) : fetch(input, init);
  };
}

test('if the browser blocks ranges, the whole file is requested', async (t) => {
  const file = fileOf(40_000);
  const server = await serve(t, (_, response) => {
    response.writeHead(200, { 'content-encoding': 'gzip' });
    response.end(gzipSync(file));
  });
  const requests: string[] = [];
  const { source, pauses } = createSource(server.url, { fetch: withoutRanges(requests) });
  (await new ReceivedFile(40_000).read(source, range(0, 100))).assertEqual(file, range(0, 40_000));
  assert.deepEqual(requests, ['range', 'range', 'whole']);
  assert.equal(pauses.length, 2);
  await drain(source, range(30_000, 40_000));
  assert.equal(requests.length, 3);
});

test('an interrupted whole file is not continued by a range that the browser blocks', async (t) => {
  const file = fileOf(40_000);
  const server = await serve(t, (_, response, count) => {
    response.writeHead(200, { 'content-length': file.length });
    sendBody(response, file, count * 15_000);
  });
  const requests: string[] = [];
  const { source } = createSource(server.url, { fetch: withoutRanges(requests) });
  (await new ReceivedFile(40_000).read(source, range(0, 100))).assertEqual(file, range(0, 40_000));
  assert.deepEqual(requests, ['range', 'range', 'whole', 'whole', 'whole']);
});

test('after one response, only ranges are requested', async (t) => {
  const file = fileOf(5000);
  const server = await serve(t, (request, response, count) => {
    if (count > 1 && count < 5) response.socket?.destroy();
    else respond(request, response, file);
  });
  const { source } = createSource(server.url);
  await drain(source, range(0, 100));
  await drain(source, range(200, 300));
  assert.deepEqual(server.ranges, ['0-99', ...Array(4).fill('200-299')]);
});

test('other statuses are http-status without a retry', async (t) => {
  for (const status of [404, 403, 204]) {
    const server = await serve(t, (_, response) => response.writeHead(status).end());
    await assert.rejects(drain(createSource(server.url).source, range(0, 1000)), {
      code: 'http-status',
      message: new RegExp(`rose\\.ltm .* answered ${status}`),
    });
    assert.equal(server.ranges.length, 1);
  }
});

test('a web page instead of the file is http-type', async (t) => {
  const headers = { 'content-type': 'text/html; charset=utf-8' };
  const whole = await serve(t, (_, response) => response.writeHead(200, headers).end('<p>Log in'));
  const wrong = { code: 'http-type', message: /rose\.ltm .* web page \(text\/html\)/ };
  await assert.rejects(drain(createSource(whole.url).source, range(0, 1000)), wrong);
  const part = await serve(t, (request, response) =>
    respond(request, response, fileOf(1000), { headers }),
  );
  await assert.rejects(drain(createSource(part.url).source, range(0, 1000)), wrong);
});

test('another range than the requested one is http-range', async (t) => {
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
    const server = await serve(t, (_, response) => {
      response.writeHead(206, headers);
      response.end(fileOf(5000));
    });
    await assert.rejects(
      drain(createSource(server.url).source, range(100, 200)),
      { code: 'http-range', message: /rose\.ltm .* bytes 100 to 199 .* the server sent others/ },
      JSON.stringify(headers),
    );
    assert.equal(server.ranges.length, 1);
  }
});

test('silence before the head and within the body is limited', async (t) => {
  const file = fileOf(1000);
  const server = await serve(t, (request, response, count) => {
    if (count === 1) return;
    if (count === 3) return respond(request, response, file);
    response.writeHead(206, { 'content-range': 'bytes 0-999/1000' });
    response.write(file.subarray(0, 100));
  });
  const { source } = createSource(server.url, { stallMs: 150 });
  (await new ReceivedFile(1000).read(source, range(0, 1000))).assertEqual(file, range(0, 1000));
  assert.deepEqual(server.ranges, ['0-999', '0-999', '100-999']);

  const closed: Promise<unknown>[] = [];
  const silent = await serve(t, (_, response) => closed.push(once(response, 'close')));
  const { source: stuck } = createSource(silent.url, { stallMs: 10, maxRetries: 1 });
  await assert.rejects(drain(stuck, range(0, 1000)), {
    code: 'http-stalled',
    message: /rose\.ltm could not be loaded: no data arrived for \d+ seconds\. .* 2 times/,
  });
  await Promise.all(closed);
});

/** Aborts a read, and checks that no listener and no transfer is left. */
async function abortWhen(
  t: TestContext,
  handler: (response: ServerResponse, abort: () => void) => void,
  ports: (abort: () => void) => Partial<HttpSourcePorts> = () => ({}),
): Promise<void> {
  const controller = new AbortController();
  const reason = new Error('no longer needed');
  const abort = () => controller.abort(reason);
  const closed: Promise<unknown>[] = [];
  const server = await serve(t, (_, response) => {
    closed.push(once(response, 'close'));
    handler(response, abort);
  });
  const { source } = createSource(server.url, ports(abort));
  const { signal } = controller;
  await assert.rejects(drain(source, range(0, 1000), signal), (thrown) => thrown === reason);
  assert.equal(getEventListeners(signal, 'abort').length, 0);
  await Promise.all(closed);
  await assert.rejects(drain(source, range(0, 1000), signal), (thrown) => thrown === reason);
}

test('an abort ends every wait with its reason', async (t) => {
  // During the wait for the head.
  await abortWhen(t, (_, abort) => setTimeout(abort, 5));
  // During the wait for the body.
  await abortWhen(t, (response, abort) => {
    response.writeHead(206, { 'content-length': 500 });
    response.write(fileOf(100));
    setTimeout(abort, 5);
  });
  // During the pause before a retry, even if the port ignores its signal.
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

test('an abort ends the wait for a fetch that ignores its signal', async () => {
  const controller = new AbortController();
  const { source } = createSource('rose.ltm', { fetch: () => new Promise(() => {}) });
  setTimeout(() => controller.abort(new Error('no longer needed')), 5);
  await assert.rejects(drain(source, range(0, 10), controller.signal), /no longer needed/);
});

test('an abort between two pieces rejects the next', async (t) => {
  const closed: Promise<unknown>[] = [];
  const server = await serve(t, (request, response) => {
    closed.push(once(response, 'close'));
    respond(request, response, fileOf(4_000_000));
  });
  const controller = new AbortController();
  const { source } = createSource(server.url);
  const pieces = source.read(range(0, 4_000_000), controller.signal);
  await pieces.next();
  controller.abort(new Error('no longer needed'));
  await Promise.all(closed);
  await assert.rejects(pieces.next(), /no longer needed/);
  assert.equal(getEventListeners(controller.signal, 'abort').length, 0);
});

test('an abort rejects the next piece even if the whole body has arrived', async () => {
  const body = new ReadableStream<Uint8Array>({
    start: (stream) => {
      stream.enqueue(fileOf(100));
      stream.enqueue(fileOf(100));
      stream.close();
    },
  });
  const headers = { 'content-range': 'bytes 0-199/200' };
  const { source } = createSource('rose.ltm', {
    fetch: async () => new Response(body, { status: 206, headers }),
  });
  const controller = new AbortController();
  const pieces = source.read(range(0, 200), controller.signal);
  await pieces.next();
  controller.abort(new Error('no longer needed'));
  await assert.rejects(pieces.next(), /no longer needed/);
});

test('a reader that stops leaves no listener', async (t) => {
  const closed: Promise<unknown>[] = [];
  const server = await serve(t, (request, response) => {
    closed.push(once(response, 'close'));
    respond(request, response, fileOf(4_000_000));
  });
  const { signal } = new AbortController();
  const { source } = createSource(server.url);
  for await (const _ of source.read(range(0, 4_000_000), signal)) break;
  assert.equal(closed.length, 1);
  await Promise.all(closed);
  assert.equal(getEventListeners(signal, 'abort').length, 0);
});

test('an error ends the transfer', async (t) => {
  const closed: Promise<unknown>[] = [];
  const server = await serve(t, (_, response) => {
    closed.push(once(response, 'close'));
    response.writeHead(404).write('…');
  });
  const { source } = createSource(server.url);
  await assert.rejects(drain(source, range(0, 100)), { code: 'http-status' });
  await Promise.all(closed);
});

test('an abort ends the pause before a retry', async (t) => {
  const controller = new AbortController();
  const server = await serve(t, (_, response) => {
    response.writeHead(503, { 'retry-after': '20' }).end();
    setTimeout(() => controller.abort(new Error('no longer needed')), 50);
  });
  const source = new HttpSource(server.url, { fetch });
  await assert.rejects(drain(source, range(0, 10), controller.signal), /no longer needed/);
  assert.equal(server.ranges.length, 1);
});

test('random failures never change the bytes', async (t) => {
  const file = fileOf(200_000);
  let seed = 7;
  const random = (below: number) => {
    seed = (seed * 48_271) % 2_147_483_647;
    return seed % below;
  };
  const server = await serve(t, (request, response) => {
    const outcome = random(6);
    if (outcome === 0) response.writeHead(503).end();
    else if (outcome === 1) response.socket?.destroy();
    else {
      const breakAfter = outcome === 2 ? random(3000) : file.length;
      respond(request, response, file, { headers: { etag: '"a"' }, breakAfter });
    }
  });
  for (let round = 0; round < 20; round++) {
    const { source } = createSource(server.url, { maxRetries: 30 });
    const ranges = Array.from({ length: 8 }, (_, i) => {
      const start = i * 25_000 + random(10_000);
      return range(start, start + random(15_000));
    }).sort(() => random(3) - 1);
    const received = new ReceivedFile(200_000);
    for (const each of ranges) await received.read(source, each);
    // The whole file if the first requests had no response; otherwise the last byte is not requested.
    received.assertEqual(file, ...(received.counts.at(-1) ? [range(0, 200_000)] : ranges));
  }
});
