import assert from 'node:assert/strict';
import test from 'node:test';
import type { DrawingModule } from '../engine/types.js';
import type { DecoderState } from './main-thread-decoder.js';
import { type Answer, type Request, WorkerDecoder, type WorkerLike } from './worker-decoder.js';

const stateAt = (bytesFed: number): DecoderState => ({
  bytesFed,
  fileBytes: 900,
  scansDone: 0,
  next: undefined,
});

/** A worker that answers by a script. */
class FakeWorker implements WorkerLike {
  onmessage: WorkerLike['onmessage'] = null;
  onerror: WorkerLike['onerror'] = null;
  onmessageerror: WorkerLike['onmessageerror'] = null;
  ended = false;
  readonly asked: Request[] = [];

  constructor(answers: (request: Request) => Answer[]) {
    this.#answers = answers;
  }
  readonly #answers: (request: Request) => Answer[];

  postMessage(request: Request): void {
    assert.ok(!this.ended, 'nothing is asked of a worker that has ended');
    this.asked.push(request);
    for (const answer of this.#answers(request)) this.say(answer);
  }

  say(data: Answer): void {
    queueMicrotask(() => {
      if (!this.ended) this.onmessage?.({ data } as MessageEvent<Answer>);
    });
  }

  die(message: string): void {
    queueMicrotask(() => this.onerror?.({ message } as ErrorEvent));
  }

  terminate(): void {
    this.ended = true;
  }
}

const HEAD: Answer = {
  kind: 'head',
  head: {
    width: 1,
    height: 2,
    lightWidth: 1,
    lightHeight: 1,
    tiles: 2,
    tileSide: 1,
    geometry: new Float64Array(12),
    basis: new Float32Array(9),
    metadata: '{}',
    decodedBytes: 700,
  },
};
const tile = (length: number): Answer => ({ kind: 'tile', bytes: new Uint8Array(length) });

async function started(answers: (request: Request) => Answer[]) {
  const worker = new FakeWorker(answers);
  const starting = WorkerDecoder.start(worker);
  worker.say({ kind: 'ready', state: stateAt(0) });
  return { worker, decoder: await starting };
}

test('bytes go to the worker and a photograph comes of them, tile by tile', async () => {
  const { worker, decoder } = await started((request) =>
    request.kind === 'feed'
      ? [{ kind: 'fed', state: stateAt(request.offset + request.bytes.length) }]
      : [HEAD, tile(40), tile(50), { kind: 'done' }],
  );
  assert.equal(decoder.state.bytesFed, 0);
  await decoder.feed(0, new Uint8Array(300));
  await decoder.feed(300, new Uint8Array(600));
  assert.deepEqual(decoder.state, stateAt(900));
  const photograph = await decoder.finish();
  assert.ok(worker.ended);
  assert.equal(photograph.info.decodedBytes, 700);
  const sizes: [number, number][] = [];
  const module = {
    Photo: {
      receive: () => ({
        putTile: (index: number, bytes: Uint8Array) => sizes.push([index, bytes.length]),
        free() {},
      }),
    },
  } as unknown as DrawingModule;
  await photograph.withModule(module, () => {});
  assert.deepEqual(sizes, [
    [0, 40],
    [1, 50],
  ]);
});

test('a coarser photograph comes of what is there by then, and the decoder goes on', async () => {
  const { worker, decoder } = await started((request) =>
    request.kind === 'feed'
      ? [{ kind: 'fed', state: stateAt(300) }]
      : request.kind === 'preview' && decoder.state.bytesFed > 0
        ? [HEAD, tile(4), tile(5), { kind: 'done' }]
        : [{ kind: 'done' }],
  );
  assert.equal(await decoder.preview(), null);
  await decoder.feed(0, new Uint8Array(300));
  const preview = await decoder.preview();
  assert.equal(preview?.share, 1 / 3);
  assert.ok(!worker.ended);
});

test('what is wrong with a file keeps its code', async () => {
  const { decoder } = await started(() => [
    { kind: 'failed', code: 'format-checksum', message: 'tile 3 is damaged' },
  ]);
  const wrong = { code: 'format-checksum', message: 'tile 3 is damaged' };
  await assert.rejects(decoder.feed(0, new Uint8Array(1)), wrong);
  // And of that nothing more can come.
  await assert.rejects(decoder.finish(), wrong);
});

test('a worker that does not start is told, and ended', async () => {
  for (const fail of [
    (worker: FakeWorker) => worker.die('refused by a policy'),
    (worker: FakeWorker) => worker.say({ kind: 'failed', code: 'wasm-unavailable', message: '' }),
  ]) {
    const worker = new FakeWorker(() => []);
    const starting = WorkerDecoder.start(worker);
    fail(worker);
    await assert.rejects(starting, { name: 'PhotoError' });
    assert.ok(worker.ended);
  }
});

test('a worker that dies at it is worker-unavailable', async () => {
  const { worker, decoder } = await started(() => []);
  const feeding = decoder.feed(0, new Uint8Array(1));
  worker.die('out of memory');
  await assert.rejects(feeding, { code: 'worker-unavailable', message: /out of memory/ });
});

test('a worker that falls silent is worker-unavailable', async () => {
  const worker = new FakeWorker(() => []);
  const starting = WorkerDecoder.start(worker, { lookMs: 1, looks: 3 });
  worker.say({ kind: 'ready', state: stateAt(0) });
  const decoder = await starting;
  await assert.rejects(decoder.feed(0, new Uint8Array(1)), { code: 'worker-unavailable' });
});

test('a decoder that is freed keeps nobody waiting', async () => {
  const { worker, decoder } = await started(() => []);
  const feeding = decoder.feed(0, new Uint8Array(1));
  decoder.free();
  await assert.rejects(feeding, { name: 'PhotoError' });
  assert.ok(worker.ended);
});

test('a photograph that is not received whole is none', async () => {
  for (const answers of [
    [HEAD, tile(40), { kind: 'failed', code: 'internal', message: 'no memory' }],
    [HEAD, tile(40), { kind: 'done' }],
    [{ kind: 'done' }],
  ] as Answer[][]) {
    const { worker, decoder } = await started(() => answers);
    await assert.rejects(decoder.finish(), { code: 'internal' });
    assert.ok(worker.ended);
  }
});
