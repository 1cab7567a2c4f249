import assert from 'node:assert/strict';
import test from 'node:test';
import type { RelightModule } from '../engine/wasm-exports.js';
import { START_ID, type WorkerRequest, type WorkerResponse } from '../shared/worker-client.js';
import type { DecoderProgress, PhotoDecoder } from './photo-decoder.js';
import {
  type DecodeResult,
  type DecodeTask,
  type DecodeWorker,
  DecodeWorkers,
} from './worker-decoder.js';

const LIMITS = { intervalMs: 1, maxChecks: 3, maxStartChecks: 1000 };

const stateAt = (bytesFed: number): DecoderProgress => ({
  bytesFed,
  fileBytes: 900,
  bytesOfLevels: 900,
  scansDone: 0,
  next: undefined,
});

const noYield = async () => {};

type Response = WorkerResponse<null, DecodeResult>;

/** A worker that answers by a function, apart from `open`; it stays silent for `undefined`. */
class FakeWorker implements DecodeWorker {
  onmessage: DecodeWorker['onmessage'] = null;
  onerror: DecodeWorker['onerror'] = null;
  onmessageerror: DecodeWorker['onmessageerror'] = null;
  hasEnded = false;
  /** Files. */
  opened = 0;
  readonly #answer: (task: DecodeTask) => DecodeResult | undefined;

  constructor(answer: (task: DecodeTask) => DecodeResult | undefined) {
    this.#answer = answer;
  }

  postMessage({ id, task }: WorkerRequest<DecodeTask>): void {
    assert.ok(!this.hasEnded, 'a worker that has ended gets no requests');
    if (task.kind === 'open') this.opened += 1;
    const result = task.kind === 'open' ? { state: stateAt(0) } : this.#answer(task);
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
function photoWith(...tileLengths: number[]) {
  const descriptor = {
    width: 1,
    height: 2,
    lightWidth: 1,
    lightHeight: 1,
    tiles: 2,
    tileSide: 1,
    geometry: new Float64Array(12),
    basis: new Float32Array(9),
    levels: new Float64Array(),
    metadata: '{}',
    decodedBytes: 700,
  };
  const tiles = tileLengths.map((length) => new Uint8Array(length));
  return { photo: { descriptor, tiles }, memoryBytes: 1 << 20 } satisfies DecodeResult;
}

/** Workers that start at once; `all` are those that were started. */
function startWorkers(answer: (task: DecodeTask) => DecodeResult | undefined, maxIdleMs = 1000) {
  const all: FakeWorker[] = [];
  const start = () => {
    const worker = new FakeWorker(answer);
    all.push(worker);
    worker.respond({ kind: 'done', id: START_ID, result: null });
    return worker;
  };
  return { all, workers: new DecodeWorkers(start, LIMITS, maxIdleMs) };
}

async function createDecoder(workers: DecodeWorkers): Promise<PhotoDecoder> {
  const decoder = await workers.createDecoder();
  assert.ok(decoder);
  return decoder;
}

async function started(answer: (task: DecodeTask) => DecodeResult | undefined) {
  const { all, workers } = startWorkers(answer);
  const decoder = await createDecoder(workers);
  return { worker: all[0] as FakeWorker, decoder };
}

test('the worker gets the bytes and sends the photograph', async () => {
  const { worker, decoder } = await started((task) =>
    task.kind === 'feed' ? { state: stateAt(task.offset + task.bytes.length) } : photoWith(40, 50),
  );
  assert.equal(decoder.state.bytesFed, 0);
  await decoder.feed(0, new Uint8Array(300), noYield);
  await decoder.feed(300, new Uint8Array(600), noYield);
  assert.deepEqual(decoder.state, stateAt(900));
  const photograph = await decoder.finish();
  assert.ok(!worker.hasEnded, 'it can decode the next one');
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
    return decoder.state.bytesFed > 0 ? photoWith(4, 5) : { photo: null, memoryBytes: 0 };
  });
  assert.equal(await decoder.preview(), null);
  await decoder.feed(0, new Uint8Array(300), noYield);
  const preview = await decoder.preview();
  assert.equal(preview?.completeness, 1 / 3);
  assert.ok(!worker.hasEnded);
});

test('an error of the file keeps its code', async () => {
  const error = { code: 'format-checksum', message: 'tile 3 is damaged' };
  for (const fail of [
    (decoder: PhotoDecoder) => decoder.feed(0, new Uint8Array(1), noYield),
    (decoder: PhotoDecoder) => decoder.finish(),
  ]) {
    const { worker, decoder } = await started(() => ({ error }));
    await assert.rejects(fail(decoder), error);
    assert.ok(worker.hasEnded, 'the state of its module is unknown');
  }
});

test('a worker that does not start rejects and is ended', async () => {
  for (const fail of [
    (worker: FakeWorker) => worker.crash('blocked by a policy'),
    (worker: FakeWorker) => worker.respond({ kind: 'failed', message: 'no module' }),
  ]) {
    const worker = new FakeWorker(() => undefined);
    const starting = new DecodeWorkers(() => worker).createDecoder();
    fail(worker);
    await assert.rejects(starting, { name: 'PhotoError' });
    assert.ok(worker.hasEnded);
  }
});

test('a worker that crashes is worker-unavailable', async () => {
  const { worker, decoder } = await started(() => undefined);
  const feeding = decoder.feed(0, new Uint8Array(1), noYield);
  worker.crash('out of memory');
  await assert.rejects(feeding, { code: 'worker-unavailable', message: /out of memory/ });
});

test('a worker that falls silent is worker-unavailable', async () => {
  const { decoder } = await started(() => undefined);
  await assert.rejects(decoder.feed(0, new Uint8Array(1), noYield), {
    code: 'worker-unavailable',
    message: /does not answer/,
  });
});

test('freeing a decoder rejects its requests', async () => {
  const { worker, decoder } = await started(() => undefined);
  const feeding = decoder.feed(0, new Uint8Array(1), noYield);
  decoder.free();
  await assert.rejects(feeding, { name: 'PhotoError' });
  assert.ok(worker.hasEnded);
});

test('a photograph without all its tiles is an internal error', async () => {
  for (const result of [
    { error: { code: 'internal', message: 'no memory' } },
    photoWith(40),
    { photo: null, memoryBytes: 0 },
  ] as DecodeResult[]) {
    const { worker, decoder } = await started(() => result);
    await assert.rejects(decoder.finish(), { code: 'internal' });
    assert.ok(worker.hasEnded);
  }
});

test('a worker decodes one photograph after another, and ends when it is idle', async () => {
  const { all, workers } = startWorkers(() => photoWith(4, 5), 20);
  for (let i = 0; i < 3; i += 1) await (await createDecoder(workers)).finish();
  assert.deepEqual(
    all.map(({ opened }) => opened),
    [3],
  );
  await new Promise((resolve) => setTimeout(resolve, 100));
  assert.ok(all[0]?.hasEnded);
  await (await createDecoder(workers)).finish();
  assert.equal(all.length, 2);
});

test('photographs at the same time have a worker each, of which one is kept', async () => {
  const { all, workers } = startWorkers(() => photoWith(4, 5));
  const decoders = await Promise.all([createDecoder(workers), createDecoder(workers)]);
  for (const decoder of decoders) await decoder.finish();
  assert.deepEqual(
    all.map(({ hasEnded }) => hasEnded),
    [false, true],
  );
});

test('a worker whose memory has grown ends with its photograph', async () => {
  const { worker, decoder } = await started(() => ({ ...photoWith(4, 5), memoryBytes: 1 << 28 }));
  await decoder.finish();
  assert.ok(worker.hasEnded);
});

test('an idle worker that stops is replaced', async () => {
  const { all, workers } = startWorkers(() => photoWith(4, 5));
  await (await createDecoder(workers)).finish();
  all[0]?.crash('out of memory');
  await new Promise((resolve) => setImmediate(resolve));
  await (await createDecoder(workers)).finish();
  assert.equal(all.length, 2);
});

test('a page that may not start workers gets no decoder', async () => {
  assert.equal(await new DecodeWorkers(() => null).createDecoder(), null);
});
