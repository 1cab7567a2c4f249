/**
 * The workers that relight on the CPU: a few a page, shared by all photographs. Each has some rows of a
 * photograph, and of their tiles the only copy there is.
 */

import type { Light } from '../../engine/types.js';
import type { Head } from '../../photo/photograph.js';
import { letGo, PhotoError } from '../../shared/errors.js';
import { allEnded } from '../../shared/promises.js';
import type { Showing, Task } from './protocol.js';
import { type Patience, WorkerClient, type WorkerLike } from './worker-client.js';

/** Rows of a picture. */
export interface Rows {
  readonly first: number;
  readonly count: number;
  /** RGBA, row by row. */
  readonly pixels: ArrayBuffer;
}

/** Rows of a photograph that one worker is to have. */
interface Share {
  readonly firstRow: number;
  readonly rows: number;
  readonly firstTile: number;
  readonly endTile: number;
}

/** After so many incidents without a frame between, workers are done without. */
const MOST_INCIDENTS = 3;
/** Largest frames take a second or two on slow machines. The module the page has had already. */
const PATIENCE: Patience = { lookMs: 1000, looks: 10, startLooks: 15 };

/** So many start unasked: few photographs are too small for them. */
const GATHERED = 2;

/** See the module. */
export class WorkerPool {
  readonly #start: () => WorkerLike | null;
  readonly #size: number;
  readonly #patience: Patience;
  #clients: WorkerClient[] = [];
  #shifts = 0;
  #incidents = 0;
  /** Those that were there at the last incident: where they stop too, it is a part of it. */
  #involved: ReadonlySet<WorkerClient> = new Set();
  #lastId = 0;
  /** Why the page is better off without workers. */
  #unfit: PhotoError | null = null;

  /** At most `size` workers, each started when there is work for it; all end with the last photograph. */
  constructor(start: () => WorkerLike | null, size: number, patience = PATIENCE) {
    this.#start = start;
    this.#size = size;
    this.#patience = patience;
  }

  /**
   * Makes room for a photograph's tiles. Rejects with `worker-unavailable` where workers cannot be had;
   * once that is for good, at once.
   */
  async open(photo: Head): Promise<PoolSession> {
    this.#shifts += 1;
    let clients: WorkerClient[] = [];
    try {
      const shares = sharesOf(photo, this.#size);
      clients = this.#pick(shares.length);
      for (const client of clients) client.photos += 1;
      const kernels = await Promise.all(clients.map((client) => client.ready));
      // Meanwhile one that was up may have stopped.
      for (const { failure } of clients) if (failure) throw failure;
      this.#lastId += 1;
      const tell = { leave: () => this.#leave(clients), drew: () => this.#recover() };
      return new PoolSession(this.#lastId, photo, clients, shares, kernels[0] ?? '', tell);
    } catch (thrown) {
      this.#leave(clients);
      throw thrown;
    }
  }

  /**
   * Has some workers start before it is known how many there is work for. They stay until what it gives is
   * called, and for work.
   */
  gather(): () => void {
    this.#shifts += 1;
    try {
      this.#pick(Math.min(this.#size, GATHERED));
    } catch {
      // Told to who has work.
    }
    return () => this.#leave([]);
  }

  /** Workers for so many shares: those with the least to do, and new ones before any has two. */
  #pick(count: number): WorkerClient[] {
    const picked: WorkerClient[] = [];
    while (picked.length < count) {
      if (this.#unfit) throw this.#unfit;
      const others = this.#clients.filter((client) => !picked.includes(client));
      const idlest = others.sort((a, b) => a.photos - b.photos)[0];
      if (idlest && (idlest.photos === 0 || this.#clients.length >= this.#size))
        picked.push(idlest);
      else picked.push(this.#hire());
    }
    return picked;
  }

  #hire(): WorkerClient {
    const worker = this.#start();
    if (!worker) {
      this.#unfit = new PhotoError('worker-unavailable', 'The page may not start workers.');
      throw this.#unfit;
    }
    const client = new WorkerClient(worker, this.#patience, () => this.#stopped(client));
    this.#clients.push(client);
    return client;
  }

  #stopped(client: WorkerClient): void {
    if (!this.#involved.has(client)) {
      this.#incidents += 1;
      this.#involved = new Set(this.#clients);
    }
    this.#clients = this.#clients.filter((other) => other !== client);
    // One that says that it cannot start is not worth another try.
    const hopeless = !client.started && !client.silent;
    if (hopeless || this.#incidents >= MOST_INCIDENTS) this.#unfit ??= client.failure;
  }

  /** A frame was drawn: whatever happened before is over. */
  #recover(): void {
    this.#incidents = 0;
    this.#involved = new Set();
  }

  #leave(clients: readonly WorkerClient[]): void {
    for (const client of clients) client.photos -= 1;
    this.#shifts -= 1;
    // Not at once: another photograph is often about to take the place of the last one.
    if (this.#shifts === 0) setTimeout(() => this.#goHome());
  }

  #goHome(): void {
    if (this.#shifts > 0) return;
    for (const client of this.#clients) client.end();
    this.#clients = [];
  }
}

/** What a crew is told of a photograph's place with it. */
interface Listener {
  /** A whole picture was drawn. */
  drew(): void;
  /** The place is free. */
  leave(): void;
}

/** A photograph's place with a crew. */
export class PoolSession {
  /** What does the work. */
  readonly kernel: string;
  readonly #id: number;
  readonly #clients: readonly WorkerClient[];
  readonly #shares: readonly Share[];
  readonly #listener: Listener;
  /** Memory for those of each share; `null` where a worker has it. */
  readonly #pixels: (ArrayBuffer | null)[];
  readonly #width: number;
  /** Rows of the light that each share sees, from one up to another; `null` while tiles come and go. */
  #seen: readonly (readonly [first: number, end: number])[] | null = null;
  /** The light that each share has; `null` where it has none. */
  #lit: (Light | null)[] = [];
  #over = false;

  constructor(
    id: number,
    photo: Head,
    clients: readonly WorkerClient[],
    shares: readonly Share[],
    kernel: string,
    listener: Listener,
  ) {
    this.#id = id;
    this.#clients = clients;
    this.#shares = shares;
    this.#listener = listener;
    this.kernel = kernel;
    this.#pixels = shares.map(() => null);
    this.#width = photo.width;
    const { geometry, basis } = photo;
    clients.forEach((client, i) => {
      const { firstRow, rows } = shares[i] as Share;
      // Where this fails, so does all that is asked next.
      void client.ask(id, { kind: 'open', geometry, basis, firstRow, rows }).catch(() => {});
    });
  }

  /** Workers at it. */
  get size(): number {
    return this.#clients.length;
  }

  /** Why it cannot go on, once a worker has stopped; its tiles are gone then. */
  get failure(): PhotoError | null {
    return this.#clients.find((client) => client.failure)?.failure ?? null;
  }

  /** The tiles of each worker, by number. */
  get tiles(): number[][] {
    return this.#shares.map(({ firstTile, endTile }) =>
      Array.from({ length: endTile - firstTile }, (_, i) => firstTile + i),
    );
  }

  /** Moves a tile in. `bytes` are still here where they never left. */
  async put(index: number, bytes: Uint8Array<ArrayBuffer>): Promise<void> {
    this.#seen = null;
    await this.#ask(this.#of(index), { kind: 'put', index, bytes }, [bytes.buffer]);
  }

  /** Moves a tile out. */
  async take(index: number): Promise<Uint8Array<ArrayBuffer>> {
    this.#seen = null;
    return new Uint8Array(await this.#ask(this.#of(index), { kind: 'take', index }));
  }

  /** Gets ready to relight, once all tiles are in. */
  async plan(): Promise<void> {
    if (this.#seen) return;
    this.#lit = [];
    this.#seen = await allEnded(
      this.#clients.map(async (client) => {
        const rows = new Uint32Array(await this.#ask(client, { kind: 'plan' }));
        return [rows[0] ?? 0, rows[1] ?? 0] as const;
      }),
    );
  }

  /**
   * The whole picture. The memory it is in is used again for the next. Comes after `plan`, and not again
   * before it has settled, which is when all workers are done. `light` may be freed at once; the same one
   * again is not brought to the workers again.
   */
  async relight(light: Light, showing: Showing): Promise<Rows[]> {
    const work = this.#shares.map((share, i) => this.#relightShare(share, i, light, showing));
    const picture = await allEnded(work);
    this.#listener.drew();
    return picture;
  }

  async #relightShare(
    { firstRow: first, rows: count }: Share,
    i: number,
    light: Light,
    showing: Showing,
  ): Promise<Rows> {
    const [from, to] = this.#seen?.[i] ?? [0, 0];
    const seen =
      light === this.#lit[i] ? null : (light.linearRgb(from, to) as Float32Array<ArrayBuffer>);
    const room = this.#pixels[i] ?? new ArrayBuffer(4 * this.#width * count);
    this.#pixels[i] = null;
    const task = { kind: 'relight', light: seen, showing, pixels: room } as const;
    const lent = seen ? [seen.buffer, room] : [room];
    const pixels = await this.#ask(this.#clients[i] as WorkerClient, task, lent);
    this.#pixels[i] = pixels;
    this.#lit[i] = light;
    return { first, count, pixels };
  }

  /** Lets go of all that the workers have of the photograph, and keeps nobody waiting. */
  end(): void {
    if (this.#over) return;
    this.#over = true;
    for (const client of this.#clients) client.forget(this.#id);
    this.#listener.leave();
  }

  /** A worker asked for a photograph that it has let go would take it for a fault of its own. */
  async #ask(
    client: WorkerClient,
    task: Task,
    transfer: Transferable[] = [],
  ): Promise<ArrayBuffer> {
    if (this.#over) throw letGo();
    return await client.ask(this.#id, task, transfer);
  }

  #of(tile: number): WorkerClient {
    const share = this.#shares.findIndex(({ endTile }) => tile < endTile);
    return this.#clients[share] as WorkerClient;
  }
}

/** Rows of whole tiles, about as many for each worker. */
function sharesOf(photo: Head, most: number): Share[] {
  const { width, height, tileSide } = photo;
  const [across, down] = [Math.ceil(width / tileSide), Math.ceil(height / tileSide)];
  const count = Math.min(most, down);
  return Array.from({ length: count }, (_, i) => {
    const [from, to] = [i, i + 1].map((n) => Math.round((n * down) / count)) as [number, number];
    const firstRow = from * tileSide;
    return {
      firstRow,
      rows: Math.min(to * tileSide, height) - firstRow,
      firstTile: from * across,
      endTile: to * across,
    };
  });
}
