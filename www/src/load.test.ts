import assert from 'node:assert/strict';
import test from 'node:test';
import type { Decoder, Photo } from './engine.js';
import { type LoadPorts, openPhoto } from './load.js';

const FILE_BYTES = 1000;
const ADDRESS = 'https://museum.example/rose.ltm';
const never = new AbortController().signal;

/** A decoder of files of 1000 bytes whose byte 500 must not be 1; counts those alive. */
class FakeDecoder implements Decoder {
  static alive = 0;
  bytesFed = 0;

  constructor() {
    FakeDecoder.alive += 1;
  }

  get fileBytes(): number | undefined {
    return this.bytesFed >= 100 ? FILE_BYTES : undefined;
  }

  feed(bytes: Uint8Array): void {
    const at = 500 - this.bytesFed;
    if (bytes[at] === 1)
      throw Object.assign(new Error('tile 3 is damaged'), { code: 'format-checksum' });
    this.bytesFed += bytes.byteLength;
  }

  finish(): Photo {
    this.free();
    if (this.bytesFed < FILE_BYTES) {
      throw Object.assign(new Error('the file is cut short'), { code: 'format-truncated' });
    }
    return { free() {} } as Photo;
  }

  free(): void {
    FakeDecoder.alive -= 1;
  }
}

interface World {
  headers?: Record<string, string>;
  engine?: LoadPorts['engine'];
  fetched?: (signal: AbortSignal | null | undefined) => void;
}

function ports(file: Uint8Array<ArrayBuffer>, world: World = {}): LoadPorts {
  let time = 0;
  return {
    engine: world.engine ?? (() => Promise.resolve({ Decoder: FakeDecoder })),
    fetch: (_, init) => {
      world.fetched?.(init?.signal);
      return Promise.resolve(new Response(file, { headers: world.headers ?? {} }));
    },
    pause: () => Promise.resolve(),
    now: () => (time += 5),
  };
}

test('a whole file becomes a photograph, with its progress told', async () => {
  const told: [number, number][] = [];
  const world = { headers: { 'content-length': '1000' } };
  await openPhoto(ADDRESS, never, (...p) => told.push(p), ports(new Uint8Array(FILE_BYTES), world));
  assert.deepEqual(told.at(-1), [1000, 1000]);
  assert.equal(FakeDecoder.alive, 0);
});

test('whatever length the server tells, the file’s own is the total', async () => {
  // Compressed bytes, where the answer is another origin's: fewer, or for a file like ours more.
  for (const headers of [{}, { 'content-length': '600' }, { 'content-length': '1100' }]) {
    const told: [number, number][] = [];
    const world = ports(new Uint8Array(FILE_BYTES), { headers });
    await openPhoto(ADDRESS, never, (...p) => told.push(p), world);
    assert.deepEqual(told.at(-1), [1000, 1000]);
  }
});

test('a damaged file keeps the decoder’s code and frees the decoder', async () => {
  const file = new Uint8Array(FILE_BYTES);
  file[500] = 1;
  await assert.rejects(
    openPhoto(ADDRESS, never, () => {}, ports(file)),
    {
      name: 'PhotoError',
      code: 'format-checksum',
      message: 'tile 3 is damaged',
    },
  );
  assert.equal(FakeDecoder.alive, 0);
});

test('a file short on the server is told from one short in transfer', async () => {
  const file = new Uint8Array(700);
  const whole = { headers: { 'content-length': '700' } };
  await assert.rejects(
    openPhoto(ADDRESS, never, () => {}, ports(file, whole)),
    {
      code: 'format-truncated',
    },
  );
  await assert.rejects(
    openPhoto(ADDRESS, never, () => {}, ports(file)),
    {
      code: 'http-short',
      message: /700 of 1000 bytes/,
    },
  );
  const cut = { headers: { 'content-length': '1000' } };
  await assert.rejects(
    openPhoto(ADDRESS, never, () => {}, ports(file, cut)),
    {
      code: 'http-short',
      message: /700 of 1000 bytes/,
    },
  );
  assert.equal(FakeDecoder.alive, 0);
});

test('an abort between two pieces frees the decoder and the transfer', async () => {
  const abort = new AbortController();
  const stop = () => abort.abort(new Error('another src'));
  await assert.rejects(
    openPhoto(ADDRESS, abort.signal, stop, ports(new Uint8Array(FILE_BYTES))),
    /another src/,
  );
  assert.equal(FakeDecoder.alive, 0);
});

test('a module that does not start ends the transfer too', async () => {
  let signal: AbortSignal | null | undefined;
  const world: World = {
    engine: () => Promise.reject(new Error('no wasm')),
    fetched: (s) => {
      signal = s;
    },
  };
  await assert.rejects(
    openPhoto(ADDRESS, never, () => {}, ports(new Uint8Array(1), world)),
    {
      code: 'internal',
    },
  );
  assert.equal(signal?.aborted, true);
});
