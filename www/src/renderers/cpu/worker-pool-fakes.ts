/** What tests of the crew share: workers that paint with the numbers of tiles, and photographs. */

import assert from 'node:assert/strict';
import type { CpuModule, DecodedPhoto, DrawnPhoto, Light } from '../../engine/types.js';
import { PLAIN } from '../../player/settings-fakes.js';
import type { Answer, Request, Showing } from './protocol.js';
import type { Patience, WorkerLike } from './worker-client.js';
import { WorkerPool } from './worker-pool.js';

/** As taken, in full. */
export const SHOWING: Showing = { output: PLAIN, gamut: 'srgb', detail: 1 };

/** A tile is one row of one pixel, which its number paints. */
const SIDE = 1;

/** A worker that does what it is asked, later. */
export class FakeWorker implements WorkerLike {
  onmessage: WorkerLike['onmessage'] = null;
  onerror: WorkerLike['onerror'] = null;
  onmessageerror: WorkerLike['onmessageerror'] = null;
  /** Tiles of each photograph. */
  readonly held = new Map<number, Set<number>>();
  /** What it was asked, in order. */
  readonly log: string[] = [];
  ended = false;
  /** Photographs that a light was brought to. */
  readonly lit = new Set<number>();
  /** Asked, and not answered while it is slow. */
  readonly owed: Request[] = [];
  slow = false;
  /** Thrown in the place of taking a request. */
  refusal: Error | null = null;

  /** Says that it is up. */
  start(): this {
    this.say({ kind: 'ready', kernel: 'fake' });
    return this;
  }

  say(data: Answer): void {
    setImmediate(() => {
      if (!this.ended) this.onmessage?.({ data } as MessageEvent<Answer>);
    });
  }

  postMessage(request: Request, transfer: Transferable[]): void {
    assert.ok(!this.ended, 'nothing is asked of a worker that has ended');
    if (this.refusal) throw this.refusal;
    // As browsers do: what is transferred is gone here.
    const sent = structuredClone(request, { transfer: transfer as ArrayBuffer[] });
    this.log.push(sent.task.kind);
    if (this.slow) this.owed.push(sent);
    else this.answer(sent);
  }

  /** Answers what it owes. */
  hurry(): void {
    this.slow = false;
    for (const request of this.owed.splice(0)) this.answer(request);
  }

  answer({ number, photo, task }: Request): void {
    const tiles = this.held.get(photo);
    if (task.kind !== 'open') assert.ok(tiles, `${task.kind} of what it does not have`);
    let bytes = new ArrayBuffer(0);
    if (task.kind === 'open') this.held.set(photo, new Set());
    if (task.kind === 'close') this.held.delete(photo);
    if (task.kind === 'put') {
      assert.equal(task.bytes[0], task.index);
      tiles?.add(task.index);
    }
    if (task.kind === 'take') {
      assert.ok(tiles?.delete(task.index), `tile ${task.index} is there`);
      bytes = Uint8Array.of(task.index).buffer;
    }
    // Tiles that come and go leave what is made of them behind.
    if (task.kind === 'put' || task.kind === 'take') this.lit.delete(photo);
    if (task.kind === 'plan') bytes = Uint32Array.of(2, 5).buffer;
    if (task.kind === 'relight') {
      if (task.light) {
        assert.deepEqual(task.light, Float32Array.of(2, 5));
        this.lit.add(photo);
      }
      assert.ok(this.lit.has(photo), 'a light is there');
      assert.equal(task.pixels.byteLength, 4 * (tiles?.size ?? 0));
      new Uint32Array(task.pixels).set([...(tiles ?? [])].sort((a, b) => a - b));
      bytes = task.pixels;
    }
    this.say({ kind: 'done', number, bytes });
  }

  /** Stops by itself, and the browser tells. */
  die(): void {
    this.onerror?.({ message: 'out of memory' } as ErrorEvent);
  }

  terminate(): void {
    this.ended = true;
  }
}

/** For tests of silence, which cannot be told from slowness on a slow machine. */
export const IMPATIENT: Patience = { lookMs: 10, looks: 3, startLooks: 3 };

/**
 * A photograph of so many tiles, one below the other, in the decoder's module; one that draws, and the tiles that
 * are in either; and how many photographs in modules are alive.
 */
export function photoOf(tiles: number) {
  const has = new Set(Array.from({ length: tiles }, (_, i) => i));
  const state = { alive: 0, refuses: false };
  const room = (own: Set<number>) => {
    let freed = false;
    state.alive += 1;
    return {
      takeTile: (index: number) => {
        assert.ok(
          !freed && own.delete(index) && has.delete(index),
          `tile ${index} is in one place`,
        );
        return Uint8Array.of(index);
      },
      putTile: (index: number, bytes: Uint8Array) => {
        assert.ok(!freed);
        if (state.refuses) {
          throw Object.assign(new Error('there is no memory'), { code: 'format-limit' });
        }
        assert.equal(bytes[0], index);
        own.add(index);
        has.add(index);
      },
      free: () => {
        assert.ok(!freed);
        freed = true;
        state.alive -= 1;
      },
    } satisfies DrawnPhoto;
  };
  const photo: DecodedPhoto = {
    width: 1,
    height: tiles,
    lightWidth: 1,
    lightHeight: tiles,
    tileSide: SIDE,
    tiles,
    metadata: '{}',
    decodedBytes: tiles,
    geometryParcel: () => new Float64Array(12),
    basisParcel: () => new Float32Array(9),
    ...room(new Set(has)),
  };
  const module = {
    Photo: { receive: () => room(new Set()) },
    Light: { builtin: () => light, torch: () => light },
    Display: class {
      free() {}
    },
    cpuKernel: () => 'fake, in the page',
    Relighter: class {
      readonly gamut = 'srgb';
      free() {}
    },
  } as unknown as CpuModule;
  return { photo, has, state, module };
}

/** A light that tells which of its rows were asked for. */
export const light: Light = {
  linearRgb: (first, end) => Float32Array.of(first, end),
  free: () => {},
};

/** What is painted: the number of each tile, from the top down. */
export function painted(rows: readonly { first: number; pixels: ArrayBuffer }[]): number[] {
  return rows.flatMap(({ first, pixels }) => {
    const tiles = [...new Uint32Array(pixels)];
    assert.equal(tiles[0], first);
    return tiles;
  });
}

/** A crew and its workers, which are up at once unless `prepare` says otherwise. */
export function crewOf(
  size: number,
  prepare = (worker: FakeWorker): unknown => worker.start(),
  patience: Patience = { lookMs: 10, looks: 1000, startLooks: 1000 },
) {
  const workers: FakeWorker[] = [];
  const start = () => {
    const worker = new FakeWorker();
    workers.push(worker);
    // Whoever starts it listens by then.
    setImmediate(() => prepare(worker));
    return worker;
  };
  return {
    pool: new WorkerPool(start, size, patience),
    workers,
    /** Once those that nobody needs have ended. */
    alive: async () => {
      await settle();
      return workers.filter(({ ended }) => !ended).length;
    },
  };
}

/** Lets workers do all that they can. */
export async function settle(): Promise<void> {
  for (let i = 0; i < 40; i += 1) await new Promise((resolve) => setImmediate(resolve));
  // Where there is nothing to do, those took no time.
  await new Promise((resolve) => setTimeout(resolve, 3));
}
