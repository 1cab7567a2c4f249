import assert from 'node:assert/strict';
import test from 'node:test';
import type { RelightModule } from '../engine/wasm-exports.js';
import { START_ID, type WorkerRequest, type WorkerResponse } from '../shared/worker-client.js';
import type { DecoderProgress } from './photo-decoder.js';
import {
  type DecodeResult,
  type DecodeTask,
  type DecodeWorker,
  startWorkerDecoder,
} from './worker-decoder.js';

const LIMITS = { intervalMs: 1, maxChecks: 3, maxStartChecks: 1000 };

const stateAt = (bytesFed: number): DecoderProgress => ({
  bytesFed,
  fileBytes: 900,
  scansDone: 0,
  next: undefined,
});

type Response = WorkerResponse<DecoderProgress, DecodeResult>;

/** A worker that answers by a function; it stays silent for `undefined`. */
class FakeWorker implements DecodeWorker {
  onmessage: DecodeWorker['onmessage'] = null;
  onerror: DecodeWorker['onerror'] = null;
  onmessageerror: DecodeWorker['onmessageerror'] = null;
  hasEnded = false;
  readonly #answer: (task: DecodeTask) => DecodeResult | undefined;

  constructor(answer: (task: DecodeTask) => DecodeResult | undefined) {
    this.#answer = answer;
  }

  postMessage({ id, task }: WorkerRequest<DecodeTask>): void {
    assert.ok(!this.hasEnded, 'a worker that has ended gets no requests');
    const result = this.#answer(task);
    if (result) this.respond({ kind: 'done', id, result });
  }

  respond(data: Response): void {
    queueMicrotask(() => {
      if (!this.hasEnded) this.onmessage?.({ data } as MessageEvent<Response>);
    });
  }

  crash(message: string): void {
    queueMicrotask(() => this.onerror?.({ message } as ErrorEvent));
  }

  terminate(): void {
    this.hasEnded = true;
  }
}

/** A photograph of two tiles with the given lengths. */
function photoWith(...tileLengths: number[]): DecodeResult {
  const descriptor = {
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
  };
  return { photo: { descriptor, tiles: tileLengths.map((length) => new Uint8Array(length)) } };
}

async function started(answer: (task: DecodeTask) => DecodeResult | undefined) {
  const worker = new FakeWorker(answer);
  const starting = startWorkerDecoder(worker, LIMITS);
  worker.respond({ kind: 'done', id: START_ID, result: stateAt(0) });
  return { worker, decoder: await starting };
}

test('the worker gets the bytes and sends the photograph', async () => {
  const { worker, decoder } = await started((task) =>
    task.kind === 'feed' ? { state: stateAt(task.offset + task.bytes.length) } : photoWith(40, 50),
  );
  assert.equal(decoder.state.bytesFed, 0);
  await decoder.feed(0, new Uint8Array(300));
  await decoder.feed(300, new Uint8Array(600));
  assert.deepEqual(decoder.state, stateAt(900));
  const photograph = await decoder.finish();
  assert.ok(worker.hasEnded);
  assert.equal(photograph.info.decodedBytes, 700);
  const sizes: [number, number][] = [];
  const module = {
    Photo: {
      receive: () => ({
        putTile: (index: number, bytes: Uint8Array) => sizes.push([index, bytes.length]),
        free() {},
      }),
    },
  } as unknown as RelightModule;
  await photograph.withModule(module, () => {});
  assert.deepEqual(sizes, [
    [0, 40],
    [1, 50],
  ]);
});

test('a preview knows its completeness, and the decoder goes on', async () => {
  const { worker, decoder } = await started((task) => {
    if (task.kind === 'feed') return { state: stateAt(300) };
    return decoder.state.bytesFed > 0 ? photoWith(4, 5) : { photo: null };
  });
  assert.equal(await decoder.preview(), null);
  await decoder.feed(0, new Uint8Array(300));
  const preview = await decoder.preview();
  assert.equal(preview?.completeness, 1 / 3);
  assert.ok(!worker.hasEnded);
});

test('an error of the file keeps its code', async () => {
  const error = { code: 'format-checksum', message: 'tile 3 is damaged' };
  const { decoder } = await started(() => ({ error }));
  await assert.rejects(decoder.feed(0, new Uint8Array(1)), error);
  await assert.rejects(decoder.finish(), error);
});

test('a worker that does not start rejects and is ended', async () => {
  for (const fail of [
    (worker: FakeWorker) => worker.crash('blocked by a policy'),
    (worker: FakeWorker) => worker.respond({ kind: 'failed', message: 'no module' }),
  ]) {
    const worker = new FakeWorker(() => undefined);
    const starting = startWorkerDecoder(worker);
    fail(worker);
    await assert.rejects(starting, { name: 'PhotoError' });
    assert.ok(worker.hasEnded);
  }
});

test('a worker that crashes is worker-unavailable', async () => {
  const { worker, decoder } = await started(() => undefined);
  const feeding = decoder.feed(0, new Uint8Array(1));
  worker.crash('out of memory');
  await assert.rejects(feeding, { code: 'worker-unavailable', message: /out of memory/ });
});

test('a worker that falls silent is worker-unavailable', async () => {
  const { decoder } = await started(() => undefined);
  await assert.rejects(decoder.feed(0, new Uint8Array(1)), {
    code: 'worker-unavailable',
    message: /does not answer/,
  });
});

test('freeing a decoder rejects its requests', async () => {
  const { worker, decoder } = await started(() => undefined);
  const feeding = decoder.feed(0, new Uint8Array(1));
  decoder.free();
  await assert.rejects(feeding, { name: 'PhotoError' });
  assert.ok(worker.hasEnded);
});

test('a photograph without all its tiles is an internal error', async () => {
  for (const result of [
    { error: { code: 'internal', message: 'no memory' } },
    photoWith(40),
    { photo: null },
  ] as DecodeResult[]) {
    const { worker, decoder } = await started(() => result);
    await assert.rejects(decoder.finish(), { code: 'internal' });
    assert.ok(worker.hasEnded);
  }
});
