/** Workers for tests of a recovery. Tile `i` has the record [i]. */

import {
  START_ID,
  type WatchdogLimits,
  type WorkerRequest,
  type WorkerResponse,
} from '../shared/worker-client.js';
import type {
  RecoveryCalls,
  RecoveryResult,
  RecoveryTask,
  RecoveryWorker,
  SentError,
} from './protocol.js';
import { RecoveryClient } from './recovery-client.js';

type Response = WorkerResponse<SentError | null, RecoveryResult>;
export type FakeAnswers = { readonly [M in keyof RecoveryCalls]?: (...args: never[]) => unknown };

/** A watchdog that slow machines do not trigger. */
export const LONG_LIMITS: WatchdogLimits = {
  intervalMs: 10,
  maxChecks: 1000,
  maxStartChecks: 1000,
};

const CORRESPONDENCE = [
  [0.5, 0, 0],
  [0, 0.5, 0],
];

/** A recovery of 4 × 3 tiles. */
export const TILES = 12;
export const COLUMNS = 4;

const ANSWERS: FakeAnswers = {
  readFolder: () => ({
    width: 128,
    height: 96,
    correspondence: CORRESPONDENCE,
    shotsUsed: [0, 1, 3],
    unknownFields: ['someday'],
  }),
  beginPictures: () => undefined,
  finishPictures: () => ({
    width: 128,
    height: 96,
    correspondence: CORRESPONDENCE,
    shotsUsed: [0, 1],
    unknownFields: [],
  }),
  prepare: () => ({
    tiles: TILES,
    tileColumns: COLUMNS,
    window: 15,
    rank: 20,
    expectedSnr: 12.34,
  }),
  packInput: () => Uint8Array.of(1),
  prepareWith: () => undefined,
  pack: () => Uint8Array.of(1),
  packRows: (tileRow: number) => ({ first: 32 * tileRow, samples: Float32Array.of(tileRow) }),
  solveTile: (tile: number) => Uint8Array.of(tile),
  finish: () => ({
    lightWidth: 64,
    lightHeight: 48,
    saturatedSamples: 10,
    overexposedPixels: 3,
    warnings: ['low-snr', 'overexposed'],
  }),
  encode: () => Uint8Array.of(1, 2, 3),
};

/** Answers each request in a later task, as `answers` says, or as an ordinary worker. */
export class FakeWorker implements RecoveryWorker {
  onmessage: RecoveryWorker['onmessage'] = null;
  onerror: RecoveryWorker['onerror'] = null;
  onmessageerror: RecoveryWorker['onmessageerror'] = null;
  /** The methods that were called, in order. */
  readonly log: string[] = [];
  /** The tiles whose records arrived, or that it recovered itself. */
  readonly tiles: number[] = [];
  hasEnded = false;
  /** Requests of this method are not answered. */
  silentMethod: keyof RecoveryCalls | null = null;
  answers: FakeAnswers;

  constructor(answers: FakeAnswers = {}, startError: SentError | null = null) {
    this.answers = { ...ANSWERS, ...answers };
    setImmediate(() => this.respond({ kind: 'done', id: START_ID, result: startError }));
  }

  respond(data: Response): void {
    setImmediate(() => {
      if (!this.hasEnded) this.onmessage?.({ data } as MessageEvent<Response>);
    });
  }

  postMessage(request: WorkerRequest<RecoveryTask>, transfer: Transferable[]): void {
    if (this.hasEnded) throw new Error('a worker that has ended gets no requests');
    // Detaches transferred buffers, as browsers do.
    const { id, task } = structuredClone(request, { transfer: transfer as never[] });
    const { method, args } = task;
    this.log.push(method);
    if (method === this.silentMethod) return;
    if (method === 'putTile' || method === 'recoverTile') this.tiles.push(args[0] as number);
    try {
      const answer = this.answers[method] as ((...args: readonly unknown[]) => unknown) | undefined;
      const value = answer?.(...args);
      this.respond({ kind: 'progress', id, steps: 1 });
      this.respond({ kind: 'done', id, result: { value } });
    } catch (thrown) {
      const { code, message } = thrown as SentError;
      const result = { error: { code, message }, stopped: code === 'internal' };
      this.respond({ kind: 'done', id, result });
    }
  }

  /** Stops, and the browser reports it. */
  crash(): void {
    this.onerror?.({ message: 'out of memory' } as ErrorEvent);
  }

  terminate(): void {
    this.hasEnded = true;
  }
}

export function fakeClient(worker: FakeWorker, limits = LONG_LIMITS): RecoveryClient {
  return new RecoveryClient(worker, limits);
}

/** Waits until the workers have done everything that they can. */
export async function settle(): Promise<void> {
  for (let i = 0; i < 60; i += 1) await new Promise((resolve) => setImmediate(resolve));
}
