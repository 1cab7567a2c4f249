/**
 * The photographs of a page: one for each address or source, which all elements with it share. They are loaded in the
 * order of a `LoadQueue`. Beyond a limit of decoded bytes, photographs that are out of view are released, the farthest
 * first; their elements keep a resting picture, and open them again when they come near.
 */

import { memoryLimit } from '../shared/memory-limit.js';
import { Deferred, withTimeout } from '../shared/promises.js';
import type { LoadOptions } from './load-options.js';
import { LoadQueue, OUT_OF_VIEW, type Placement, type QueuedLoad } from './load-queue.js';
import type { LoadedPhotograph } from './photograph.js';
import { RefCounted } from './ref-counted.js';
import type { PhotographSource } from './types.js';

export type SharedPhoto = RefCounted<LoadedPhotograph>;

export interface PhotoAddress {
  /** An absolute address, or what stands for a file. */
  readonly src: string | PhotographSource;
  readonly credentials: RequestCredentials;
}

/** An element, from `open` until its signal is aborted. */
export interface PhotoUser {
  readonly placement: Placement;
  /** Whether it shows a resting picture, so that its photograph may wait for room. */
  readonly isResting: boolean;
  readonly wantsPreviews: boolean;
  progress(loaded: number, total: number): void;
  /** The preview is shared by the users that want previews: each retains it, or leaves it. */
  preview(photo: SharedPhoto): void;
  /** Whether its picture can stay without the photograph. */
  readonly canRest: boolean;
  /** Keeps the picture, releases the photograph and aborts the signal; does nothing if that is impossible. */
  rest(): void;
}

export type LoadPhoto = (address: PhotoAddress, options: LoadOptions) => Promise<LoadedPhotograph>;

/** Decoded bytes above which photographs that are out of view are released: less on devices with little memory. */
const MAX_DECODED_BYTES = 256 * 2 ** 20;
const MAX_DECODED_BYTES_PER_GIB = 64 * 2 ** 20;

export class PhotoLibrary {
  /** The entry that an address has now. */
  readonly #entries = new Map<unknown, LibraryEntry>();
  readonly #loaded = new Set<LibraryEntry>();
  /** Decoded bytes of files that were loaded before. */
  readonly #sizes = new Map<unknown, number>();

  constructor(
    private readonly load: LoadPhoto,
    private readonly queue = new LoadQueue(),
    private readonly maxDecodedBytes = memoryLimit(MAX_DECODED_BYTES, MAX_DECODED_BYTES_PER_GIB),
  ) {}

  /**
   * Gives the photograph of an address, which the caller releases. It is loaded if no element has it, if its tiles are
   * lost, or for a `reload`. Rejects with the error of the load, or with the signal's reason.
   */
  open(
    address: PhotoAddress,
    user: PhotoUser,
    signal: AbortSignal,
    isReload = false,
  ): Promise<SharedPhoto> {
    const { src, credentials } = address;
    const key = typeof src === 'string' ? `${credentials} ${src}` : src;
    let entry = this.#entries.get(key);
    if (!entry || entry.photo?.value.isLost || (isReload && entry.photo)) {
      entry = this.#addEntry(key, address);
    }
    return entry.join(user, signal);
  }

  /** Elements have moved, or may rest now. */
  update(): void {
    this.#makeRoom(0, OUT_OF_VIEW);
    this.queue.schedule();
  }

  #addEntry(key: unknown, address: PhotoAddress): LibraryEntry {
    const entry: LibraryEntry = new LibraryEntry((options) => this.load(address, options), {
      mayStart: () => {
        const hasRoom = this.#makeRoom(this.#sizes.get(key) ?? 0, entry.placement);
        return hasRoom || entry.placement < OUT_OF_VIEW || !entry.isResting;
      },
      loaded: (bytes) => {
        if (typeof key === 'string') this.#sizes.set(key, bytes);
        this.#loaded.add(entry);
        this.update();
      },
      ended: () => {
        this.queue.remove(entry);
        // Its room is free.
        this.queue.schedule();
        this.#loaded.delete(entry);
        if (this.#entries.get(key) === entry) this.#entries.delete(key);
      },
    });
    this.#entries.set(key, entry);
    this.queue.add(entry);
    return entry;
  }

  /** Releases photographs that are farther away than `placement`; gives whether `bytes` more fit in then. */
  #makeRoom(bytes: number, placement: Placement): boolean {
    let excess = bytes - this.maxDecodedBytes;
    for (const entry of this.#loaded) excess += entry.decodedBytes;
    if (excess <= 0) return true;
    const nearest = Math.max(placement, OUT_OF_VIEW);
    const farther = [...this.#loaded]
      .map((entry) => ({ entry, placement: entry.placement }))
      .filter((placed) => placed.placement > nearest && placed.entry.canRest)
      .sort((a, b) => b.placement - a.placement);
    for (const { entry } of farther) {
      if (excess <= 0) break;
      const { decodedBytes } = entry;
      entry.rest();
      if (!this.#loaded.has(entry)) excess -= decodedBytes;
    }
    return excess <= 0;
  }
}

interface EntryEvents {
  mayStart(): boolean;
  loaded(decodedBytes: number): void;
  /** The load has failed, or the last user has left. */
  ended(): void;
}

/** One load of an address, and its photograph. */
class LibraryEntry implements QueuedLoad {
  photo: SharedPhoto | null = null;
  readonly #users = new Set<PhotoUser>();
  readonly #abort = new AbortController();
  readonly #opened = new Deferred<SharedPhoto>();

  constructor(
    private readonly load: (options: LoadOptions) => Promise<LoadedPhotograph>,
    private readonly events: EntryEvents,
  ) {
    this.#opened.promise.catch(() => {});
  }

  get placement(): Placement {
    return Math.min(...[...this.#users].map((user) => user.placement));
  }

  get isResting(): boolean {
    return [...this.#users].every((user) => user.isResting);
  }

  get canRest(): boolean {
    return [...this.#users].every((user) => user.canRest);
  }

  get decodedBytes(): number {
    return this.photo?.value.info.decodedBytes ?? 0;
  }

  async join(user: PhotoUser, signal: AbortSignal): Promise<SharedPhoto> {
    this.#users.add(user);
    signal.addEventListener('abort', () => this.#leave(user));
    const photo = await withTimeout(this.#opened.promise, { signal });
    signal.throwIfAborted();
    photo.retain();
    return photo;
  }

  mayStart(): boolean {
    return this.events.mayStart();
  }

  rest(): void {
    for (const user of [...this.#users]) user.rest();
  }

  async run(setWaiting: (isWaiting: boolean) => void): Promise<void> {
    const sharePreview = (photograph: LoadedPhotograph): void => {
      const preview = new RefCounted(photograph);
      for (const user of this.#users) if (user.wantsPreviews) user.preview(preview);
      preview.release();
    };
    const users = this.#users;
    try {
      const photograph = await this.load({
        signal: this.#abort.signal,
        onProgress: (...progress) => {
          for (const user of users) user.progress(...progress);
        },
        get onPreview() {
          return [...users].some((user) => user.wantsPreviews) ? sharePreview : null;
        },
        onWaiting: setWaiting,
      });
      if (users.size === 0) {
        photograph.free();
        return;
      }
      this.photo = new RefCounted(photograph);
      this.#opened.resolve(this.photo);
      this.events.loaded(photograph.info.decodedBytes);
    } catch (thrown) {
      this.#opened.reject(thrown);
      this.events.ended();
    }
  }

  #leave(user: PhotoUser): void {
    this.#users.delete(user);
    if (this.#users.size > 0) return;
    this.events.ended();
    this.#abort.abort();
    this.photo?.release();
    this.photo = null;
  }
}
