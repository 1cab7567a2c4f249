/**
 * A decoded photograph. Its tiles take most of the memory and exist once: as bytes on the page, in one of its modules,
 * or in workers. A renderer has them moved to where it draws. Uses of the tiles run in the order of the calls.
 */

import type {
  DecodedPhoto,
  Freeable,
  ImportedPhoto,
  ModulePhoto,
  RelightModule,
} from '../engine/wasm-exports.js';
import { messageOf, PhotoError, photoReleased } from '../shared/errors.js';
import { allSettledOrThrow } from '../shared/promises.js';
import type { ByteRange, ColorMatrix, PhotoInfo } from '../shared/value-types.js';
import { parseColorMatrix, parseMetadata } from './metadata.js';
import {
  describePhoto,
  type PhotoDescriptor,
  type RelightingPool,
  type TilesInWorkers,
  type TransferredTile,
} from './types.js';

/** A module of the page with tiles in its memory. */
interface ModuleTiles {
  /** `null` for the decoder's. */
  readonly module: RelightModule | null;
  readonly photo: ModulePhoto;
  /** Called before tiles leave the module. */
  readonly onLeave: Set<() => void>;
}

/** 'in transit': sent to a worker, or requested from it. */
type TileLocation = ModuleTiles | 'workers' | 'in transit' | TransferredTile;

/** A part of a finer level. */
export interface ShardRequest {
  /** Its bytes in the file. */
  readonly bytes: ByteRange;
  /** It has the first components only, as far as their tiles take no more memory. */
  readonly maxTileBytes: number;
}

export class LoadedPhotograph implements Freeable {
  readonly info: PhotoInfo;
  readonly colorMatrix: ColorMatrix;
  readonly hasColorMatrix: boolean;
  #tiles: TileLocation[];
  /** One, unless a move has failed halfway. */
  readonly #stores = new Set<ModuleTiles>();
  #session: TilesInWorkers | null = null;
  /** Opens a shard of its finer levels, if it has any; `null` if it is no file. */
  openShard: ((shard: ShardRequest, signal: AbortSignal) => Promise<LoadedPhotograph>) | null =
    null;
  /** For a shard: the photograph of the last level, and how many times as many light elements this level has a side. */
  root: { readonly photograph: LoadedPhotograph; readonly scale: number } | null = null;
  /** Why the photograph is unusable: tiles are lost, or it was freed. */
  #fault: PhotoError | null = null;
  /** Settles after the last use that was requested. */
  #lastUse: Promise<unknown> = Promise.resolve();

  /** Its tiles are on the page. `completeness` is the decoded share of the file, 0 to 1. Throws `format-invalid`. */
  constructor(
    readonly descriptor: PhotoDescriptor,
    tiles: TransferredTile[],
    readonly completeness = 1,
  ) {
    const { decodedBytes, levels } = descriptor;
    const [
      width = descriptor.width,
      height = descriptor.height,
      lightWidth = descriptor.lightWidth,
      lightHeight = descriptor.lightHeight,
    ] = levels;
    const metadata = parseMetadata(descriptor.metadata);
    const { color_matrix } = metadata;
    this.info = { width, height, lightWidth, lightHeight, decodedBytes, metadata };
    this.hasColorMatrix = color_matrix !== undefined;
    this.colorMatrix = parseColorMatrix(color_matrix);
    this.#tiles = tiles;
  }

  /** A photograph in the memory of the page's decoder, which is freed with it or if this throws `format-invalid`. */
  static fromModule(
    photo: DecodedPhoto,
    levels?: Float64Array,
    completeness = 1,
  ): LoadedPhotograph {
    const store: ModuleTiles = { module: null, photo, onLeave: new Set() };
    try {
      const descriptor = describePhoto(photo, levels);
      const photograph = new LoadedPhotograph(descriptor, [], completeness);
      photograph.#tiles = Array.from({ length: descriptor.tiles }, () => store);
      photograph.#stores.add(store);
      return photograph;
    } catch (thrown) {
      photo.free();
      throw thrown;
    }
  }

  /** Whether this is the whole photograph and not a preview. */
  get isComplete(): boolean {
    return this.completeness === 1;
  }

  /** Whether tiles are lost, or it was freed: every use rejects. */
  get isLost(): boolean {
    return this.#fault !== null;
  }

  /** The photograph without tiles, which suffices for making lights. The caller frees it. */
  createLightPlane(module: RelightModule): ImportedPhoto {
    return module.Photo.receive(this.descriptor.geometry, this.descriptor.basis);
  }

  /**
   * Moves all tiles to a module of the page and calls `use`, unless `signal` is aborted by then. `onLeave` is called
   * before tiles leave the module again: free whatever `use` has made of the photograph.
   */
  withModule<T>(
    module: RelightModule,
    use: (photo: ImportedPhoto) => T | Promise<T>,
    { signal, onLeave }: { signal?: AbortSignal | undefined; onLeave?: () => void } = {},
  ): Promise<T> {
    return this.#enqueue(async () => {
      signal?.throwIfAborted();
      const store = await this.#moveToModule(module);
      const result = await use(store.photo);
      if (onLeave) store.onLeave.add(onLeave);
      return result;
    });
  }

  /**
   * Moves all tiles to workers, always the same ones, and calls `use`. Rejects with `worker-unavailable` if there are
   * none; the photograph is unchanged then.
   */
  withWorkers<S extends TilesInWorkers, T>(
    workers: RelightingPool<S>,
    use: (session: S) => T | Promise<T>,
  ): Promise<T> {
    return this.#enqueue(async () => use(await this.#moveToWorkers(workers)));
  }

  free(): void {
    this.#fault ??= photoReleased();
    this.#session?.end();
    // The use in progress may still read tiles.
    void this.#lastUse.finally(() => {
      this.#tiles.fill('in transit');
      this.#freeEmptyStores();
    });
  }

  /** Runs a use after all earlier ones. Rejects with `photo-lost` once tiles are lost. */
  #enqueue<T>(use: () => Promise<T>): Promise<T> {
    const result = this.#lastUse.then(async () => {
      if (this.#fault) throw this.#fault;
      try {
        return await use();
      } catch (thrown) {
        throw this.#lossAfter(thrown) ?? thrown;
      }
    });
    this.#lastUse = result.catch(() => {});
    return result;
  }

  /** The error to report if a failed use has lost tiles. */
  #lossAfter(thrown: unknown): PhotoError | null {
    const haveWorkersFailed = this.#session?.failure != null;
    const isLost =
      this.#tiles.includes('in transit') || (haveWorkersFailed && this.#tiles.includes('workers'));
    if (!isLost) {
      // The next use gets other workers.
      if (haveWorkersFailed) this.#endSession();
      return null;
    }
    const message = `${messageOf(thrown)} A part of the photograph went with it.`;
    this.#fault ??= new PhotoError('photo-lost', message, thrown);
    this.#session?.end();
    return this.#fault;
  }

  async #moveToModule(module: RelightModule) {
    const session = this.#session;
    if (session) {
      await forEachTile(session, async (index) => {
        if (this.#tiles[index] !== 'workers') return;
        this.#tiles[index] = 'in transit';
        this.#tiles[index] = await session.take(index);
      });
      this.#endSession();
    }
    const [store, photo] = this.#storeIn(module);
    this.#announceLeave(store);
    // Tile by tile, so that few are in memory twice.
    for (const index of this.#tiles.keys()) {
      if (this.#tiles[index] === store) continue;
      photo.putTile(index, this.#toBytes(index));
      this.#tiles[index] = store;
    }
    this.#freeEmptyStores();
    return { ...store, photo };
  }

  #storeIn(module: RelightModule): [ModuleTiles, ImportedPhoto] {
    for (const store of this.#stores) {
      if (store.module === module) return [store, store.photo as ImportedPhoto];
    }
    const photo = this.createLightPlane(module);
    const store = { module, photo, onLeave: new Set<() => void>() };
    this.#stores.add(store);
    return [store, photo];
  }

  async #moveToWorkers<S extends TilesInWorkers>(workers: RelightingPool<S>): Promise<S> {
    this.#session ??= await workers.open(this.descriptor);
    const session = this.#session as S;
    if (this.#fault) {
      session.end();
      throw this.#fault;
    }
    this.#announceLeave();
    await forEachTile(session, async (index) => {
      if (this.#tiles[index] === 'workers') return;
      const bytes = this.#toBytes(index);
      this.#tiles[index] = 'in transit';
      try {
        await session.put(index, bytes);
        this.#tiles[index] = 'workers';
      } catch (thrown) {
        // A transferred buffer is empty; otherwise nothing was sent.
        if (bytes.byteLength > 0) this.#tiles[index] = bytes;
        throw thrown;
      }
    });
    this.#freeEmptyStores();
    await session.plan();
    return session;
  }

  /** Takes a tile out of its module, if it is in one. */
  #toBytes(index: number): TransferredTile {
    const location = this.#tiles[index] as ModuleTiles | TransferredTile;
    if (location instanceof Uint8Array) return location;
    const bytes = location.photo.takeTile(index) as TransferredTile;
    this.#tiles[index] = bytes;
    return bytes;
  }

  #announceLeave(except?: ModuleTiles): void {
    for (const store of this.#stores) {
      if (store === except) continue;
      for (const onLeave of store.onLeave) onLeave();
      store.onLeave.clear();
    }
  }

  #freeEmptyStores(): void {
    for (const store of this.#stores) {
      if (this.#tiles.includes(store)) continue;
      for (const onLeave of store.onLeave) onLeave();
      store.photo.free();
      this.#stores.delete(store);
    }
  }

  #endSession(): void {
    this.#session?.end();
    this.#session = null;
  }
}

/** Moves tile after tile, so that few are in memory twice, but with all workers at once. */
async function forEachTile(session: TilesInWorkers, move: (index: number) => Promise<void>) {
  await allSettledOrThrow(
    session.tiles.map(async (tiles) => {
      for (const index of tiles) await move(index);
    }),
  );
}
