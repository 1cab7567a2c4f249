/** Workers for tests of the pool. They paint each tile's pixel with the tile's index. */

import assert from 'node:assert/strict';
import { parseColorMatrix } from '../../photo/metadata.js';
import {
  START_ID,
  type WatchdogLimits,
  type WorkerRequest,
  type WorkerResponse,
} from '../../shared/worker-client.js';
import { PLAIN } from '../settings-fakes.js';
import type { RenderedRows } from './pool-session.js';
import type { FrameSettings, RelightWorker, RelightWorkerTask } from './protocol.js';
import { WorkerPool } from './worker-pool.js';

type Request = WorkerRequest<RelightWorkerTask>;
type Response = WorkerResponse<string, ArrayBuffer>;

export const FRAME: FrameSettings = {
  output: PLAIN,
  colorMatrix: parseColorMatrix(undefined),
  gamut: 'srgb',
  quality: 1,
  view: { left: 0, top: 0, right: Number.MAX_SAFE_INTEGER, bottom: Number.MAX_SAFE_INTEGER },
};

/** A short watchdog for tests of silence, and one that slow machines do not trigger. */
export const SHORT_LIMITS: WatchdogLimits = { intervalMs: 10, maxChecks: 3, maxStartChecks: 3 };
const LONG_LIMITS: WatchdogLimits = { intervalMs: 10, maxChecks: 1000, maxStartChecks: 1000 };

/** A worker that answers each request in a later task. */
export class FakeWorker implements RelightWorker {
  onmessage: RelightWorker['onmessage'] = null;
  onerror: RelightWorker['onerror'] = null;
  onmessageerror: RelightWorker['onmessageerror'] = null;
  /** The tiles of each photograph. */
  readonly tiles = new Map<number, Set<number>>();
  /** The kinds of the tasks, in order. */
  readonly log: string[] = [];
  hasEnded = false;
  /** Photographs whose light was sent. */
  readonly lit = new Set<number>();
  /** The requests that were not answered while `isSlow`. */
  readonly unanswered: Request[] = [];
  isSlow = false;
  /** Thrown by `postMessage`. */
  sendError: Error | null = null;

  start(): this {
    this.respond({ kind: 'done', id: START_ID, result: 'fake' });
    return this;
  }

  respond(data: Response): void {
    setImmediate(() => {
      if (!this.hasEnded) this.onmessage?.({ data } as MessageEvent<Response>);
    });
  }

  postMessage(request: Request, transfer: Transferable[]): void {
    assert.ok(!this.hasEnded, 'a worker that has ended gets no requests');
    if (this.sendError) throw this.sendError;
    // Detaches what is transferred, as browsers do.
    const sent = structuredClone(request, { transfer: transfer as ArrayBuffer[] });
    this.log.push(sent.task.task.kind);
    if (this.isSlow) this.unanswered.push(sent);
    else this.answer(sent);
  }

  /** Answers everything, and further requests at once. */
  catchUp(): void {
    this.isSlow = false;
    for (const request of this.unanswered.splice(0)) this.answer(request);
  }

  answer({ id, task: { photo, task } }: Request): void {
    const tiles = this.tiles.get(photo);
    if (task.kind !== 'open') assert.ok(tiles, `${task.kind} of an unknown photograph`);
    let result = new ArrayBuffer(0);
    if (task.kind === 'open') this.tiles.set(photo, new Set());
    if (task.kind === 'close') this.tiles.delete(photo);
    if (task.kind === 'put') {
      assert.equal(task.bytes[0], task.index);
      tiles?.add(task.index);
    }
    if (task.kind === 'take') {
      assert.ok(tiles?.delete(task.index), `tile ${task.index} is there`);
      result = Uint8Array.of(task.index).buffer;
    }
    // A worker frees its relighter, with the light, when tiles are moved.
    if (task.kind === 'put' || task.kind === 'take') this.lit.delete(photo);
    if (task.kind === 'plan') result = Uint32Array.of(2, 5).buffer;
    if (task.kind === 'relight') {
      if (task.light) {
        assert.deepEqual(task.light, Float32Array.of(2, 5));
        this.lit.add(photo);
      }
      assert.ok(this.lit.has(photo), 'the worker has a light');
      assert.equal(task.pixels.byteLength, 4 * (tiles?.size ?? 0));
      new Uint32Array(task.pixels).set([...(tiles ?? [])].sort((a, b) => a - b));
      result = task.pixels;
    }
    this.respond({ kind: 'done', id, result });
  }

  /** Stops, and the browser reports it. */
  crash(): void {
    this.onerror?.({ message: 'out of memory' } as ErrorEvent);
  }

  terminate(): void {
    this.hasEnded = true;
  }
}

/** The tile indices in a picture, from top to bottom. */
export function tileIndices(picture: readonly RenderedRows[]): number[] {
  return picture.flatMap(({ firstRow, pixels }) => {
    const tiles = [...new Uint32Array(pixels)];
    assert.equal(tiles[0], firstRow);
    return tiles;
  });
}

/** A pool and its workers, which `start` starts. */
export function fakePool(
  size: number,
  start = (worker: FakeWorker): unknown => worker.start(),
  limits = LONG_LIMITS,
) {
  const workers: FakeWorker[] = [];
  const create = () => {
    const worker = new FakeWorker();
    workers.push(worker);
    // After the pool has set its handlers.
    setImmediate(() => start(worker));
    return worker;
  };
  return {
    pool: new WorkerPool(create, size, limits),
    workers,
    /** The number of workers, once those that nobody needs have ended. */
    countAlive: async () => {
      await settle();
      return workers.filter(({ hasEnded }) => !hasEnded).length;
    },
  };
}

/** Waits until the workers have done everything that they can. */
export async function settle(): Promise<void> {
  for (let i = 0; i < 40; i += 1) await new Promise((resolve) => setImmediate(resolve));
  // The pool ends idle workers by a timer, which 40 empty turns may not reach.
  await new Promise((resolve) => setTimeout(resolve, 3));
}
