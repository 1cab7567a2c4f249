import assert from 'node:assert/strict';
import { getEventListeners } from 'node:events';
import type { IncomingMessage, ServerResponse } from 'node:http';
import test from 'node:test';
import { gzipSync } from 'node:zlib';
import { answer } from '../../tools/ranges.js';
import type { DecodedPhoto, Decoder } from '../engine/wasm-exports.js';
import { createMainThreadDecoder } from '../photo/main-thread-decoder.js';
import type { LoadedPhotograph } from '../photo/photograph.js';
import { fakePhoto } from '../photo/photograph-fakes.js';
import { never, serve, type TestServer } from './http-fakes.js';
import { type LoadPorts, openPhoto } from './load.js';

const FIRST_BYTES = 16_384;
/** The size of the demo's photograph. */
const FILE_BYTES = 800_000;
/** The fake decoder rejects a file with the value 255 here. */
const CHECKED_BYTE = 20_000;

/** A file for `FakeDecoder`, whose bytes differ from place to place. */
function fileOf(size = FILE_BYTES, headBytes = 1000): Buffer {
  const file = Buffer.alloc(
    size,
    Uint8Array.from({ length: 251 }, (_, i) => i),
  );
  file.writeUInt32LE(size, 0);
  file.writeUInt32LE(headBytes, 4);
  return file;
}

/** Counts its living instances, and keeps the bytes of the last one. */
class FakeDecoder implements Decoder {
  static alive = 0;
  static fed = Buffer.alloc(0);
  bytesFed = 0;
  readonly #bytes = Buffer.alloc(10_000_000);

  constructor() {
    FakeDecoder.alive += 1;
  }

  get fileBytes(): number | undefined {
    return this.bytesFed < 144 ? undefined : this.#bytes.readUInt32LE(0);
  }

  get bytesOfLevels(): number | undefined {
    return this.fileBytes;
  }

  levels(): Float64Array {
    return new Float64Array();
  }

  wants(): Float64Array {
    const headBytes = this.bytesFed < 144 ? FIRST_BYTES : this.#bytes.readUInt32LE(4);
    const end = this.bytesFed < headBytes ? headBytes : (this.fileBytes ?? 0);
    return this.bytesFed < end ? Float64Array.of(this.bytesFed, end) : new Float64Array();
  }

  feed(offset: number, bytes: Uint8Array): void {
    assert.ok(offset <= this.bytesFed, 'in order');
    this.#bytes.set(bytes, offset);
    this.bytesFed = Math.max(this.bytesFed, offset + bytes.byteLength);
    FakeDecoder.fed = this.#bytes.subarray(0, this.bytesFed);
    if (FakeDecoder.fed[CHECKED_BYTE] === 255) {
      throw Object.assign(new Error('tile 3 is damaged'), { code: 'format-checksum' });
    }
  }

  /** One scan per 100 kB. */
  get scansDone(): number {
    return Math.floor(this.bytesFed / 100_000);
  }

  preview(): DecodedPhoto | undefined {
    return this.scansDone > 0 ? fakePhoto(1).photo : undefined;
  }

  finish(): DecodedPhoto {
    this.free();
    return fakePhoto(1).photo;
  }

  free(): void {
    FakeDecoder.alive -= 1;
  }
}

/** Answers as a server with ranges. */
function send(request: IncomingMessage, response: ServerResponse, file: Buffer, etag = '"a"') {
  const read = (start: number, end: number) => [file.subarray(start, end)];
  const content = { size: file.length, type: 'application/vnd.ltm', etag, read };
  answer(request, response, content).catch(() => {});
}

/** The number of requested bytes, without those beyond the file's end. */
function countBytes(ranges: TestServer['ranges'], size: number): number {
  const lengths = ranges.map((range) => {
    const [first = 0, last = size - 1] = range?.split('-').map(Number) ?? [];
    return Math.min(last + 1, size) - first;
  });
  return lengths.reduce((sum, length) => sum + length, 0);
}

/** Ports whose clock advances by a millisecond with each call. */
function portsOf(ports: Partial<LoadPorts> = {}): LoadPorts {
  let time = 0;
  return {
    createDecoder: async () => createMainThreadDecoder({ Decoder: FakeDecoder }, () => time++),
    fetch: (input, init) => fetch(input, init),
    yieldToPage: () => Promise.resolve(),
    now: () => 0,
    ...ports,
  };
}

/** Ignores previews, and waits for the network. */
const ignored = {
  onPreview: (preview: LoadedPhotograph) => preview.free(),
  onWaiting: () => {},
};

/** Loads a photograph, and checks that no decoder and no listener is left. */
async function load(
  url: string,
  ports: Partial<LoadPorts> = {},
): Promise<{ progress: [number, number][]; photo: LoadedPhotograph }> {
  const progress: [number, number][] = [];
  try {
    const photo = await openPhoto(
      url,
      { signal: never, onProgress: (...p) => progress.push(p), ...ignored },
      portsOf(ports),
    );
    return { progress, photo };
  } finally {
    assert.equal(FakeDecoder.alive, 0);
    assert.equal(getEventListeners(never, 'abort').length, 0);
  }
}

test('a file takes two requests, without unused bytes', async (t) => {
  const file = fileOf();
  const server = await serve(t, (request, response) => send(request, response, file));
  const { progress } = await load(server.url);
  assert.deepEqual(server.ranges, ['0-16383', '16384-799999']);
  const ratio = countBytes(server.ranges, file.length) / file.length;
  assert.ok(ratio <= 1.05, `${ratio} requested bytes for each byte of the file`);
  assert.ok(FakeDecoder.fed.equals(file));
  const sizes = progress.map(([loaded]) => loaded);
  assert.deepEqual(
    sizes,
    [...new Set(sizes)].sort((a, b) => a - b),
  );
  assert.ok(progress.every(([, total]) => total === FILE_BYTES));
  assert.equal(sizes.at(-1), FILE_BYTES);
});

test('a small file takes one request', async (t) => {
  const file = fileOf(5000);
  const server = await serve(t, (request, response) => send(request, response, file));
  await load(server.url);
  assert.deepEqual(server.ranges, ['0-16383']);
  assert.ok(FakeDecoder.fed.equals(file));
});

test('a long index is requested first', async (t) => {
  const file = fileOf(FILE_BYTES, 50_000);
  const server = await serve(t, (request, response) => send(request, response, file));
  await load(server.url);
  assert.deepEqual(server.ranges, ['0-16383', '16384-49999', '50000-799999']);
  assert.ok(FakeDecoder.fed.equals(file));
});

test('a large file is not split into many requests', async (t) => {
  const file = fileOf(9_000_000);
  const server = await serve(t, (request, response) => send(request, response, file));
  await load(server.url);
  assert.equal(server.ranges.length, 2);
  assert.equal(FakeDecoder.fed.length, file.length);
});

test('a server without ranges gets one request', async (t) => {
  const file = fileOf();
  const server = await serve(t, (_, response) => response.end(file));
  const { progress } = await load(server.url);
  assert.deepEqual(server.ranges, ['0-16383']);
  assert.ok(FakeDecoder.fed.equals(file));
  assert.deepEqual(progress.at(-1), [FILE_BYTES, FILE_BYTES]);
});

test('a server that stops supporting ranges gets one more request', async (t) => {
  const file = fileOf();
  const server = await serve(t, (request, response, count) =>
    count === 1 ? send(request, response, file) : response.end(file),
  );
  await load(server.url);
  assert.equal(server.ranges.length, 2);
  assert.ok(FakeDecoder.fed.equals(file));
});

test('the total is the file’s own size, not the server’s', async (t) => {
  const file = fileOf();
  for (const level of [0, 9]) {
    const zipped = gzipSync(file, { level });
    const server = await serve(t, (_, response) => {
      response.writeHead(200, { 'content-encoding': 'gzip', 'content-length': zipped.length });
      response.end(zipped);
    });
    const { progress } = await load(server.url);
    assert.ok(progress.every(([, total]) => total === FILE_BYTES));
    assert.deepEqual(progress.at(-1), [FILE_BYTES, FILE_BYTES]);
  }
});

test('an interrupted transfer continues where it ended', async (t) => {
  const file = fileOf();
  const server = await serve(t, (request, response, count) => {
    if (count !== 2) return send(request, response, file);
    response.writeHead(206, { 'content-range': 'bytes 16384-799999/800000', etag: '"a"' });
    response.write(file.subarray(FIRST_BYTES, 100_000), () => response.socket?.destroySoon());
    return undefined;
  });
  await load(server.url);
  assert.deepEqual(server.ranges, ['0-16383', '16384-799999', '100000-799999']);
  assert.ok(FakeDecoder.fed.equals(file));
});

test('a damaged file has the decoder’s code and ends the transfer', async (t) => {
  const file = fileOf(8_000_000);
  file[CHECKED_BYTE] = 255;
  for (const ranges of [true, false]) {
    const server = await serve(t, (request, response) =>
      ranges ? send(request, response, file) : response.end(file),
    );
    await assert.rejects(load(server.url), {
      name: 'PhotoError',
      code: 'format-checksum',
      message: 'rose.ltm: tile 3 is damaged.',
    });
    await Promise.all(server.closed);
  }
});

test('a short file differs from a short transfer', async (t) => {
  const short = fileOf().subarray(0, 300_000);
  const parts = await serve(t, (request, response) => send(request, response, short));
  await assert.rejects(load(parts.url), {
    code: 'format-truncated',
    message: /rose\.ltm is too short: bytes 16384 to 799999 are needed, .* has only 300000\./,
  });
  assert.equal(parts.ranges.length, 1, 'the rest is of no use');
  const whole = await serve(t, (_, response) => {
    response.writeHead(200, { 'content-length': short.length }).end(short);
  });
  await assert.rejects(load(whole.url), { code: 'format-truncated', message: /only 300000/ });
  const lengthless = await serve(t, (_, response) => {
    response.writeHead(200, { 'transfer-encoding': 'chunked' }).end(short);
  });
  await assert.rejects(load(lengthless.url), {
    code: 'http-short',
    message: /rose\.ltm is incomplete: .* at byte 300000, before byte 800000/,
  });
});

test('a file with data after its end is format-invalid', async (t) => {
  const file = Buffer.concat([fileOf(), Buffer.alloc(10)]);
  const server = await serve(t, (request, response) => send(request, response, file));
  await assert.rejects(load(server.url), {
    code: 'format-invalid',
    message: /rose\.ltm is too long: .* ends at byte 800000, but the server has 800010\./,
  });
  assert.equal(server.ranges.length, 1);
});

test('an empty file is format-truncated', async (t) => {
  const parts = await serve(t, (request, response) => send(request, response, Buffer.alloc(0)));
  const whole = await serve(t, (_, response) => {
    response.writeHead(200, { 'content-length': 0 }).end();
  });
  for (const { url } of [parts, whole]) {
    await assert.rejects(load(url), {
      code: 'format-truncated',
      message: /rose\.ltm is too short: .* the server has only 0\./,
    });
  }
});

test('a file that is replaced is loaded once more, without the cache', async (t) => {
  const [before, after] = [fileOf(), fileOf(700_000)];
  const server = await serve(t, (request, response, count) =>
    count === 1 ? send(request, response, before) : send(request, response, after, '"b"'),
  );
  const caches: (RequestCache | undefined)[] = [];
  const { progress } = await load(server.url, {
    fetch: (input, init) => {
      caches.push(init?.cache);
      return fetch(input, init);
    },
  });
  assert.deepEqual(server.ranges, ['0-16383', '16384-799999', '0-16383', '16384-699999']);
  assert.deepEqual(caches, [undefined, undefined, 'reload', 'reload']);
  assert.ok(FakeDecoder.fed.equals(after));
  assert.deepEqual(progress.at(-1), [700_000, 700_000]);
});

test('a file that is replaced repeatedly is http-changed', async (t) => {
  const server = await serve(t, (request, response, count) =>
    send(request, response, fileOf(), `"${count}"`),
  );
  await assert.rejects(load(server.url), {
    name: 'PhotoError',
    code: 'http-changed',
    message: /rose\.ltm was replaced on the server/,
  });
  assert.equal(server.ranges.length, 4);
});

test('an abort between two pieces frees the decoder and ends the transfer', async (t) => {
  const file = fileOf(8_000_000);
  for (const ranges of [true, false]) {
    const server = await serve(t, (request, response) =>
      ranges ? send(request, response, file) : response.end(file),
    );
    const abort = new AbortController();
    const stop = (loaded: number) => {
      if (loaded > FIRST_BYTES) abort.abort(new Error('another src'));
    };
    await assert.rejects(
      openPhoto(server.url, { signal: abort.signal, onProgress: stop, ...ignored }, portsOf()),
      /another src/,
    );
    assert.equal(FakeDecoder.alive, 0);
    assert.equal(getEventListeners(abort.signal, 'abort').length, 0);
    await Promise.all(server.closed);
    await assert.rejects(
      openPhoto(server.url, { signal: abort.signal, onProgress: stop, ...ignored }, portsOf()),
      /another src/,
    );
    assert.equal(server.ranges.length, ranges ? 2 : 1, 'nothing more is requested');
  }
});

test('an abort while the page runs is noticed', async (t) => {
  const server = await serve(t, (request, response) => send(request, response, fileOf()));
  const abort = new AbortController();
  const yieldToPage = async () => abort.abort(new Error('another src'));
  const ports = portsOf({ yieldToPage });
  await assert.rejects(
    openPhoto(server.url, { signal: abort.signal, onProgress: () => {}, ...ignored }, ports),
    /another src/,
  );
  assert.equal(FakeDecoder.alive, 0);
});

test('an abort while the module loads does not wait for it', async (t) => {
  const server = await serve(t, (request, response) => send(request, response, fileOf()));
  const abort = new AbortController();
  const decoder = () => new Promise<never>(() => {});
  setTimeout(() => abort.abort(new Error('another src')), 20);
  await assert.rejects(
    openPhoto(
      server.url,
      { signal: abort.signal, onProgress: () => {}, ...ignored },
      portsOf({ createDecoder: decoder }),
    ),
    /another src/,
  );
});

test('a module that does not start ends the transfer', async (t) => {
  const server = await serve(t, (_, response) => response.write('…'));
  const decoder = async () => {
    while (server.closed.length === 0) await new Promise((resolve) => setTimeout(resolve));
    throw new Error('no wasm');
  };
  await assert.rejects(load(server.url, { createDecoder: decoder }), {
    code: 'internal',
    message: /no wasm/,
  });
  await Promise.all(server.closed);
});

test('a server error is reported before the module is loaded', async (t) => {
  const server = await serve(t, (_, response) => response.writeHead(404).end());
  const decoder = () => new Promise<never>(() => {});
  await assert.rejects(load(server.url, { createDecoder: decoder }), { code: 'http-status' });
});

test('decoding yields to the page, after reporting its progress', async (t) => {
  const file = fileOf();
  const server = await serve(t, (request, response) => send(request, response, file));
  let loaded = 0;
  const turns: number[] = [];
  const yieldToPage = async () => {
    turns.push(loaded);
  };
  // Eight looks at the clock make a turn, and there is one after each slice.
  await openPhoto(
    server.url,
    { signal: never, onProgress: (bytes) => (loaded = bytes), ...ignored },
    portsOf({ yieldToPage }),
  );
  assert.ok(turns.length > 70, `${turns.length} turns`);
  const steps = turns.map((at, i) => at - (turns[i - 1] ?? 0));
  assert.ok(
    steps.every((step) => step > 0 && step <= 10 << 10),
    String(steps),
  );
});

test('a decoder that asks for the same bytes again is an error', async (t) => {
  class Glutton extends FakeDecoder {
    override wants = () => Float64Array.of(0, 100);
  }
  const server = await serve(t, (request, response) => send(request, response, fileOf()));
  const decoder = async () => createMainThreadDecoder({ Decoder: Glutton }, () => 0);
  await assert.rejects(load(server.url, { createDecoder: decoder }), {
    code: 'internal',
    message: /already has/,
  });
  assert.equal(server.ranges.length, 2);
});

test('the decoder’s first range is requested, and then the next one at that time', async (t) => {
  class InThree extends FakeDecoder {
    override wants(): Float64Array {
      const { bytesFed: at } = this;
      const marks = [FIRST_BYTES, 50_000, 300_000, FILE_BYTES].filter((mark) => mark > at);
      return Float64Array.from(
        marks.flatMap((mark, i) => [i === 0 ? at : (marks[i - 1] ?? 0), mark]),
      );
    }
  }
  const file = fileOf();
  const server = await serve(t, (request, response) => send(request, response, file));
  const decoder = async () => createMainThreadDecoder({ Decoder: InThree }, () => 0);
  await load(server.url, { createDecoder: decoder });
  assert.deepEqual(server.ranges, ['0-16383', '16384-49999', '50000-299999', '300000-799999']);
  assert.ok(FakeDecoder.fed.equals(file));
});

test('previews come while the file loads, each of twice as many bytes, and not too often', async (t) => {
  const file = fileOf();
  const server = await serve(t, (request, response) => send(request, response, file));
  let now = 0;
  const shares: number[] = [];
  const keep = (preview: LoadedPhotograph) => shares.push(preview.completeness);
  const at = { now: () => now };
  await openPhoto(
    server.url,
    { signal: never, onProgress: () => (now += 1000), onPreview: keep, onWaiting: () => {} },
    portsOf(at),
  );
  assert.ok(shares.length >= 2 && shares.length <= 3, String(shares));
  assert.ok((shares[0] ?? 0) >= 0.125 && (shares[0] ?? 1) < 0.25, String(shares));
  assert.ok(shares.every((share, i) => i === 0 || share >= 2 * (shares[i - 1] ?? 1)));
  shares.length = 0;
  await openPhoto(
    server.url,
    { signal: never, onProgress: () => {}, onPreview: keep, onWaiting: () => {} },
    portsOf(at),
  );
  assert.equal(shares.length, 1, 'no time has passed');
});
