/**
 * A photograph on the page, wherever its tiles are: as they came, in one of the page's modules, or with a
 * crew of workers. They move only when they have to, and what is done with them is done one thing after
 * the other.
 */

import type { DecodedPhoto, DrawingModule, DrawnPhoto, Freeable, Photo } from '../engine/types.js';
import type { PoolSession, WorkerPool } from '../renderers/cpu/worker-pool.js';
import { letGo, messageOf, PhotoError } from '../shared/errors.js';
import { allEnded } from '../shared/promises.js';

/** Bytes of a tile that another module gave. */
export type TileBytes = Uint8Array<ArrayBuffer>;

/** What is known of a photograph. */
export interface PhotoInfo {
  /** Picture, in pixels. */
  readonly width: number;
  readonly height: number;
  /** Light plane, in elements. */
  readonly lightWidth: number;
  readonly lightHeight: number;
  /** Memory its light transport takes, in bytes. */
  readonly decodedBytes: number;
  /** What the file says of itself. */
  readonly metadata: unknown;
}

/** All of a photograph but its tiles, as modules give and take it. */
export interface Head extends Omit<PhotoInfo, 'metadata'> {
  readonly metadata: string;
  /** Number of tiles, which lie row by row. */
  readonly tiles: number;
  /** Pixels along a tile's side; those at the right and lower edges may be smaller. */
  readonly tileSide: number;
  readonly geometry: Float64Array;
  readonly basis: Float32Array;
}

/** That of a photograph in the decoder's module. */
export function headOf(photo: DecodedPhoto): Head {
  const { width, height, lightWidth, lightHeight, decodedBytes, metadata, tiles, tileSide } = photo;
  const [geometry, basis] = [photo.geometryParcel(), photo.basisParcel()];
  const info = { width, height, lightWidth, lightHeight, decodedBytes, metadata };
  return { ...info, tiles, tileSide, geometry, basis };
}

/** A module's memory with tiles in it. */
interface Room {
  /** `null` for the one that decoded them. */
  readonly module: DrawingModule | null;
  readonly photo: Photo;
  /** Told before tiles leave. */
  readonly users: Set<() => void>;
}

/** Where a tile is: in a module of the page, with the crew, on its way from or to it, or here. */
type Place = Room | 'pool' | 'away' | TileBytes;

/** See the module. */
export class Photograph implements Freeable {
  readonly info: PhotoInfo;
  readonly head: Head;
  /** How much of the file it is of, from 0 to 1, which is all. */
  readonly share: number;
  readonly #tiles: Place[];
  /** Those in modules of the page: one, unless tiles were kept from moving. */
  readonly #rooms = new Set<Room>();
  #session: PoolSession | null = null;
  /** Why it can no longer be used: tiles are gone, or it was freed. */
  #over: PhotoError | null = null;
  /** Settles when all that was asked for so far is done. */
  #last: Promise<unknown> = Promise.resolve();

  private constructor(head: Head, tiles: Place[], share: number) {
    const { width, height, lightWidth, lightHeight, decodedBytes } = head;
    const metadata = readMetadata(head.metadata);
    this.info = { width, height, lightWidth, lightHeight, decodedBytes, metadata };
    this.head = head;
    this.share = share;
    this.#tiles = tiles;
  }

  /** One that a module of the page has decoded, which is freed with this. Throws `format-invalid`. */
  static decoded(photo: DecodedPhoto, share = 1): Photograph {
    const room: Room = { module: null, photo, users: new Set() };
    try {
      const head = headOf(photo);
      const tiles = Array.from({ length: head.tiles }, () => room);
      const photograph = new Photograph(head, tiles, share);
      photograph.#rooms.add(room);
      return photograph;
    } catch (thrown) {
      photo.free();
      throw thrown;
    }
  }

  /** One that was decoded elsewhere. Throws `format-invalid`. */
  static received(head: Head, tiles: TileBytes[], share = 1): Photograph {
    return new Photograph(head, tiles, share);
  }

  /** The photograph in a module, without tiles: what lights are made for. Freed by who asks. */
  plane(module: DrawingModule): DrawnPhoto {
    return module.Photo.receive(this.head.geometry, this.head.basis);
  }

  /**
   * Does something with all tiles in a module of the page, unless `signal` is aborted by then. `leave` is
   * told before tiles leave it again; what it has made of `photo` is to be freed then.
   */
  withModule<T>(
    module: DrawingModule,
    use: (photo: DrawnPhoto) => T | Promise<T>,
    { signal, leave }: { signal?: AbortSignal; leave?: () => void } = {},
  ): Promise<T> {
    return this.#next(async () => {
      signal?.throwIfAborted();
      const room = await this.#toPage(module);
      const used = await use(room.photo);
      if (leave) room.users.add(leave);
      return used;
    });
  }

  /**
   * Does something with all tiles with a crew, always the same one. Where the crew can have no workers,
   * rejects with `worker-unavailable`, and the photograph is as it was.
   */
  withWorkers<T>(pool: WorkerPool, use: (session: PoolSession) => T | Promise<T>): Promise<T> {
    return this.#next(async () => use(await this.#toCrew(pool)));
  }

  free(): void {
    this.#over ??= letGo();
    this.#session?.end();
    // What is under way may read it still.
    void this.#last.finally(() => {
      this.#tiles.fill('away');
      this.#sweep();
    });
  }

  /** Does some work after all that was asked for before. Rejects with `photo-lost` once tiles are gone. */
  #next<T>(work: () => Promise<T>): Promise<T> {
    const done = this.#last.then(async () => {
      if (this.#over) throw this.#over;
      try {
        return await work();
      } catch (thrown) {
        throw this.#loss(thrown) ?? thrown;
      }
    });
    this.#last = done.catch(() => {});
    return done;
  }

  /** What to tell in the place of a failure after which tiles are missing. */
  #loss(thrown: unknown): PhotoError | null {
    const gone = this.#session?.failure;
    if (!this.#tiles.includes('away') && !(gone && this.#tiles.includes('pool'))) {
      // The next use has other workers.
      if (gone) this.#leaveCrew();
      return null;
    }
    this.#over ??= new PhotoError(
      'photo-lost',
      `${messageOf(thrown)} A part of the photograph went with it.`,
      thrown,
    );
    this.#session?.end();
    return this.#over;
  }

  async #toPage(module: DrawingModule): Promise<Room & { readonly photo: DrawnPhoto }> {
    const session = this.#session;
    if (session) {
      await this.#each(session, async (index) => {
        if (this.#tiles[index] !== 'pool') return;
        this.#tiles[index] = 'away';
        this.#tiles[index] = await session.take(index);
      });
      this.#leaveCrew();
    }
    const [room, photo] = this.#roomIn(module);
    this.#vacate(room);
    // Tile by tile, so that few are in two memories.
    for (const index of this.#tiles.keys()) {
      if (this.#tiles[index] === room) continue;
      const bytes = this.#takeOut(index);
      photo.putTile(index, bytes);
      this.#tiles[index] = room;
    }
    this.#sweep();
    return { ...room, photo };
  }

  #roomIn(module: DrawingModule): [Room, DrawnPhoto] {
    for (const room of this.#rooms) {
      if (room.module === module) return [room, room.photo as DrawnPhoto];
    }
    const photo = this.plane(module);
    const room = { module, photo, users: new Set<() => void>() };
    this.#rooms.add(room);
    return [room, photo];
  }

  async #toCrew(pool: WorkerPool): Promise<PoolSession> {
    this.#session ??= await pool.open(this.head);
    const session = this.#session;
    if (this.#over) {
      session.end();
      throw this.#over;
    }
    this.#vacate();
    await this.#each(session, async (index) => {
      if (this.#tiles[index] === 'pool') return;
      const bytes = this.#takeOut(index);
      this.#tiles[index] = 'away';
      try {
        await session.put(index, bytes);
        this.#tiles[index] = 'pool';
      } catch (thrown) {
        // What has left has no bytes here.
        if (bytes.byteLength > 0) this.#tiles[index] = bytes;
        throw thrown;
      }
    });
    this.#sweep();
    await session.plan();
    return session;
  }

  /** A tile that is in a module of the page, or here; it is here then. */
  #takeOut(index: number): TileBytes {
    const place = this.#tiles[index] as Room | TileBytes;
    if (place instanceof Uint8Array) return place;
    const bytes = place.photo.takeTile(index) as TileBytes;
    this.#tiles[index] = bytes;
    return bytes;
  }

  /** Tells those who use tiles in the page's modules that they leave, but for one of them. */
  #vacate(but?: Room): void {
    for (const room of this.#rooms) {
      if (room === but) continue;
      for (const leave of room.users) leave();
      room.users.clear();
    }
  }

  /** Frees rooms that no tile is in. */
  #sweep(): void {
    for (const room of this.#rooms) {
      if (this.#tiles.includes(room)) continue;
      for (const leave of room.users) leave();
      room.photo.free();
      this.#rooms.delete(room);
    }
  }

  #leaveCrew(): void {
    this.#session?.end();
    this.#session = null;
  }

  /** Tile by tile, so that few are in two places, with all workers at once. */
  async #each(session: PoolSession, move: (index: number) => Promise<void>): Promise<void> {
    await allEnded(
      session.tiles.map(async (tiles) => {
        for (const index of tiles) await move(index);
      }),
    );
  }
}

/** The metadata of a file. Throws `format-invalid`. */
function readMetadata(json: string): unknown {
  try {
    const metadata: unknown = JSON.parse(json);
    if (typeof metadata === 'object' && metadata !== null && !Array.isArray(metadata)) {
      return metadata;
    }
  } catch {
    // No JSON.
  }
  throw new PhotoError('format-invalid', 'The metadata is invalid: it is no JSON object.');
}
