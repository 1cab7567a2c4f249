/** The page's workers that relight with the CPU. Each has rows of a photograph, with the only copy of their tiles. */

import type { PhotoDescriptor, RelightingPool } from '../../photo/types.js';
import { PhotoError } from '../../shared/errors.js';
import { type WatchdogLimits, WorkerClient } from '../../shared/worker-client.js';
import { PoolSession, splitRows } from './pool-session.js';
import type { RelightClient, RelightWorker } from './protocol.js';

/** Failures of workers without a frame in between, after which the page draws by itself. */
const MAX_INCIDENTS = 3;
/**
 * The largest frames take two seconds on slow machines, and several times as long beside other work. Each answer starts
 * the count anew, so that requests may wait for each other.
 */
const LIMITS: WatchdogLimits = { intervalMs: 1000, maxChecks: 20, maxStartChecks: 60 };
const REMEDY =
  "Its script must lie beside the element's, and a content security policy must allow it in worker-src.";
/** Workers to warm up before the photograph's size is known. Most photographs need at least as many. */
const WARM_WORKERS = 2;

/** A worker, and how many photographs have rows in it. */
interface PoolWorker {
  readonly client: RelightClient;
  photos: number;
}

export class WorkerPool implements RelightingPool<PoolSession> {
  #workers: PoolWorker[] = [];
  /** Sessions and warm-ups; without any, the workers end. */
  #users = 0;
  #incidents = 0;
  /** The workers at the time of the last incident: failures among them are part of it. */
  #incidentWorkers: ReadonlySet<PoolWorker> = new Set();
  #lastPhoto = 0;
  /** Why the page must do without workers for good. */
  #fault: PhotoError | null = null;

  /** `start` gives `null` if the page may not start workers. At most `size` workers run at a time. */
  constructor(
    private readonly start: () => RelightWorker | null,
    private readonly size: number,
    private readonly limits = LIMITS,
  ) {}

  /** Makes room for a photograph. Rejects with `worker-unavailable`. */
  async open(photo: PhotoDescriptor): Promise<PoolSession> {
    this.#users += 1;
    let workers: PoolWorker[] = [];
    try {
      const ranges = splitRows(photo, this.size);
      workers = this.#pick(ranges.length);
      for (const worker of workers) worker.photos += 1;
      const kernels = await Promise.all(workers.map(({ client }) => client.ready));
      // A worker may have failed while another one started.
      for (const { client } of workers) if (client.failure) throw client.failure;
      this.#lastPhoto += 1;
      const clients = workers.map(({ client }) => client);
      return new PoolSession(this.#lastPhoto, photo, clients, ranges, kernels[0] ?? '', {
        frameDrawn: () => this.#forgetIncidents(),
        ended: () => this.#release(workers),
      });
    } catch (thrown) {
      this.#release(workers);
      throw thrown;
    }
  }

  /** Starts some workers before the photograph is known. The returned function releases them. */
  warmUp(): () => void {
    this.#users += 1;
    try {
      this.#pick(Math.min(this.size, WARM_WORKERS));
    } catch {
      // `open` reports the same error.
    }
    return () => this.#release([]);
  }

  #pick(count: number): PoolWorker[] {
    const picked: PoolWorker[] = [];
    while (picked.length < count) {
      if (this.#fault) throw this.#fault;
      const others = this.#workers.filter((worker) => !picked.includes(worker));
      const idlest = others.sort((a, b) => a.photos - b.photos)[0];
      const isFull = this.#workers.length >= this.size;
      if (idlest && (idlest.photos === 0 || isFull)) picked.push(idlest);
      else picked.push(this.#startWorker());
    }
    return picked;
  }

  #startWorker(): PoolWorker {
    const worker = this.start();
    if (!worker) {
      this.#fault = new PhotoError('worker-unavailable', 'The page may not start workers.');
      throw this.#fault;
    }
    const client: RelightClient = new WorkerClient(worker, {
      name: 'relighting worker',
      limits: this.limits,
      remedy: REMEDY,
      onFailure: () => this.#handleFailure(started),
    });
    const started: PoolWorker = { client, photos: 0 };
    this.#workers.push(started);
    return started;
  }

  #handleFailure(failed: PoolWorker): void {
    if (!this.#incidentWorkers.has(failed)) {
      this.#incidents += 1;
      this.#incidentWorkers = new Set(this.#workers);
    }
    this.#workers = this.#workers.filter((worker) => worker !== failed);
    // A worker that reports that it cannot start will never start; a silent one may have been slow.
    const { hasStarted, isSilent, failure } = failed.client;
    const isHopeless = !hasStarted && !isSilent;
    if (isHopeless || this.#incidents >= MAX_INCIDENTS) this.#fault ??= failure;
  }

  #forgetIncidents(): void {
    this.#incidents = 0;
    this.#incidentWorkers = new Set();
  }

  #release(workers: readonly PoolWorker[]): void {
    for (const worker of workers) worker.photos -= 1;
    this.#users -= 1;
    // Later, because another photograph often follows at once.
    if (this.#users === 0) setTimeout(() => this.#shutDown());
  }

  #shutDown(): void {
    if (this.#users > 0) return;
    for (const { client } of this.#workers) client.terminate();
    this.#workers = [];
  }
}
