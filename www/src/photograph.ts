/**
 * A photograph on the page, wherever its tiles are: as they came, in the page's own module, or with a
 * crew of workers. They move only when they have to, and what is done with them is done one thing after
 * the other.
 */

import type { Crew, Shift } from './crew.js';
import type { Freeable, Photo } from './engine.js';
import { messageOf, PhotoError } from './errors.js';
import { letGo } from './hand.js';
import { allEnded } from './promises.js';

/** Bytes of a tile that another module gave. */
export type TileBytes = Uint8Array<ArrayBuffer>;

/** Where a tile is: in the page's module, with the crew, on its way from or to it, or here. */
type Place = 'page' | 'crew' | 'away' | TileBytes;

/** What is known of a photograph. */
export interface Facts {
  /** Picture, in pixels. */
  readonly width: number;
  readonly height: number;
  /** Light plane, in elements. */
  readonly lightWidth: number;
  readonly lightHeight: number;
  /** Memory its light transport takes, in bytes. */
  readonly decodedBytes: number;
  /** What the file says of itself, as JSON. */
  readonly metadata: string;
}

/** See the module. */
export class Photograph implements Freeable {
  readonly facts: Facts;
  readonly #photo: Photo;
  readonly #tiles: Place[];
  #shift: Shift | null = null;
  /** Why it can no longer be used: tiles are gone, or it was freed. */
  #over: PhotoError | null = null;
  /** Settles when all that was asked for so far is done. */
  #last: Promise<unknown> = Promise.resolve();

  private constructor(photo: Photo, tiles: Place[], decodedBytes: number) {
    const { width, height, lightWidth, lightHeight, metadata } = photo;
    this.facts = { width, height, lightWidth, lightHeight, metadata, decodedBytes };
    this.#photo = photo;
    this.#tiles = tiles;
  }

  /** One that the page's module has decoded, which is freed with this. */
  static decoded(photo: Photo): Photograph {
    const tiles = Array.from({ length: photo.tiles }, () => 'page' as const);
    return new Photograph(photo, tiles, photo.decodedBytes);
  }

  /** One that another module has decoded; `photo`, which is freed with this, has all but its tiles. */
  static received(photo: Photo, tiles: TileBytes[], decodedBytes: number): Photograph {
    return new Photograph(photo, tiles, decodedBytes);
  }

  /** Does something with all tiles in the page's module, unless `signal` is aborted by then. */
  inPage<T>(use: (photo: Photo) => T | Promise<T>, signal?: AbortSignal): Promise<T> {
    return this.#next(async () => {
      signal?.throwIfAborted();
      await this.#toPage();
      return await use(this.#photo);
    });
  }

  /**
   * Does something with all tiles with a crew, always the same one; `photo` has none of them. Where
   * the crew can have no workers, rejects with `worker-unavailable`, and the photograph is as it was.
   */
  withCrew<T>(crew: Crew, use: (shift: Shift, photo: Photo) => T | Promise<T>): Promise<T> {
    return this.#next(async () => {
      const shift = await this.#toCrew(crew);
      return await use(shift, this.#photo);
    });
  }

  free(): void {
    this.#over ??= letGo();
    this.#shift?.end();
    // What is under way may read it still.
    void this.#last.finally(() => this.#photo.free());
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
    const gone = this.#shift?.failure;
    if (!this.#tiles.includes('away') && !(gone && this.#tiles.includes('crew'))) {
      // The next use has other workers.
      if (gone) this.#leave();
      return null;
    }
    this.#over ??= new PhotoError(
      'photo-lost',
      `${messageOf(thrown)} A part of the photograph went with it.`,
      thrown,
    );
    this.#shift?.end();
    return this.#over;
  }

  async #toPage(): Promise<void> {
    const shift = this.#shift;
    if (shift) {
      await this.#each(shift, async (index) => {
        if (this.#tiles[index] !== 'crew') return;
        this.#tiles[index] = 'away';
        this.#tiles[index] = await shift.take(index);
        this.#keep(index);
      });
      this.#leave();
    }
    for (const index of this.#tiles.keys()) this.#keep(index);
  }

  async #toCrew(crew: Crew): Promise<Shift> {
    this.#shift ??= await crew.open(this.#photo);
    const shift = this.#shift;
    if (this.#over) {
      shift.end();
      throw this.#over;
    }
    await this.#each(shift, async (index) => {
      const place = this.#tiles[index] as Place;
      if (place === 'crew') return;
      const bytes =
        place instanceof Uint8Array ? place : (this.#photo.takeTile(index) as TileBytes);
      this.#tiles[index] = 'away';
      try {
        await shift.put(index, bytes);
        this.#tiles[index] = 'crew';
      } catch (thrown) {
        // What has left has no bytes here.
        if (bytes.byteLength > 0) this.#tiles[index] = bytes;
        throw thrown;
      }
    });
    await shift.plan();
    return shift;
  }

  #leave(): void {
    this.#shift?.end();
    this.#shift = null;
  }

  /** Tile by tile, so that few are in two places, with all workers at once. */
  async #each(shift: Shift, move: (index: number) => Promise<void>): Promise<void> {
    await allEnded(
      shift.tiles.map(async (tiles) => {
        for (const index of tiles) await move(index);
      }),
    );
  }

  /** Takes a tile that is here into the page's module. */
  #keep(index: number): void {
    const bytes = this.#tiles[index];
    if (!(bytes instanceof Uint8Array)) return;
    this.#photo.putTile(index, bytes);
    this.#tiles[index] = 'page';
  }
}
