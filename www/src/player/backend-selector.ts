/**
 * Finds a backend for a photograph and replaces it when it is lost. A new search cancels the last, whose result is
 * freed when it comes. The picture of the last backend stays until the new one has drawn a frame.
 */

import type { Backend } from '../engine/wasm-exports.js';
import type { SharedPhoto } from '../photo/photo-library.js';
import type { BackendPreferences, CreateRenderer } from '../renderers/types.js';
import { joinSentences, PhotoError, toPhotoError } from '../shared/errors.js';
import { Deferred } from '../shared/promises.js';
import { ActiveBackend } from './active-backend.js';
import { BACKEND_TITLES, firstWorking } from './backends.js';
import type { PhotoSessionListener } from './types.js';

export interface BackendSelectorEvents {
  failed(error: PhotoError): void;
  /** A search has ended with a backend that works. */
  selected(): void;
  /** The photograph lost tiles and must be fetched again. */
  photoLost(reason: string): void;
}

/** A search, which ends also when it is cancelled. */
class BackendSearch extends Deferred {
  readonly abort = new AbortController();

  cancel(): void {
    this.abort.abort();
    this.resolve();
  }
}

export class BackendSelector {
  /** The options with which a lost backend is replaced. */
  options: BackendPreferences | null = null;
  active: ActiveBackend | null = null;
  /** On the screen until `active` has drawn. */
  #outgoing: ActiveBackend | null = null;
  #search: BackendSearch | null = null;
  /** The photograph of the last search. */
  #photo: SharedPhoto | null = null;

  constructor(
    private readonly createRenderer: CreateRenderer,
    private readonly listener: PhotoSessionListener,
    private readonly events: BackendSelectorEvents,
  ) {}

  /** Resolves when the search in progress ends; `null` if there is none. */
  get search(): Promise<void> | null {
    return this.#search?.promise ?? null;
  }

  /** Replaces the backend `previous` by the first that works. `reason` is empty if only the options have changed. */
  async select(
    photo: SharedPhoto,
    options: BackendPreferences,
    previous: Backend | null,
    reason: string,
  ): Promise<void> {
    this.#search?.cancel();
    const search = new BackendSearch();
    const { signal } = search.abort;
    this.#search = search;
    this.#photo = photo;
    // An attempt reads the photograph until it ends, even after the search was cancelled.
    photo.retain();
    try {
      const attempt = (backend: Backend) => this.#attempt(backend, options, photo, signal);
      const working = await firstWorking(options.backends, attempt, signal);
      signal.throwIfAborted();
      this.#search = null;
      this.#use(working.value, options, previous, [reason, working.reason]);
    } catch (thrown) {
      if (signal.aborted) return;
      this.#search = null;
      // A preview needs no error: the search for the whole photograph reports the same.
      if (!photo.value.isComplete) {
        if (this.active?.isFreed) this.active = null;
        return;
      }
      this.drop();
      const { code, message } = toPhotoError(thrown);
      this.events.failed(new PhotoError(code, joinSentences([reason, message]), thrown));
    } finally {
      search.resolve();
      photo.release();
    }
  }

  /** Sets a lost backend up again, or the next one if it never drew a frame, unless a search is in progress. */
  lose(lost: ActiveBackend, reason: string): void {
    const isReported = lost.lossReason !== null;
    lost.lossReason ??= reason;
    if (this.active !== lost) return;
    if (!isReported) this.listener.backendLost(lost.backend, reason);
    if (!this.#search && this.options) this.#replace(lost, this.options, lost.backend, '');
  }

  freeOutgoing(): void {
    this.#outgoing?.free();
    this.#outgoing = null;
  }

  /** Frees the backends, but not a search in progress. */
  drop(): void {
    this.active?.free();
    this.active = null;
    this.freeOutgoing();
  }

  /** Frees the backends and cancels the search. */
  release(): void {
    this.#search?.cancel();
    this.#search = null;
    this.drop();
  }

  #use(
    found: ActiveBackend,
    options: BackendPreferences,
    previous: Backend | null,
    reasons: readonly string[],
  ): void {
    const last = this.active;
    const isReplacement = reasons[0] !== '' || (last !== null && last.lossReason !== null);
    if (found !== last) {
      this.active = found;
      if (last?.hasDrawn && last.lossReason === null) this.#outgoing = last;
      else last?.free();
    }
    const reason = joinSentences([...reasons, found.renderer.warning]);
    if (found.lossReason !== null) {
      this.#replace(found, options, previous, reason);
      return;
    }
    // The same backend with another gamut is no change.
    if (found !== last && (found.backend !== previous || isReplacement)) {
      this.listener.backendChanged(found.backend, previous, reason);
    }
    this.events.selected();
  }

  #replace(
    { backend, hasDrawn, lossReason }: ActiveBackend,
    options: BackendPreferences,
    previous: Backend | null,
    reasonBefore: string,
  ): void {
    const loss = `${BACKEND_TITLES[backend]} was lost: ${lossReason}`;
    const reason = joinSentences([reasonBefore, loss]);
    const backends = options.backends.slice(options.backends.indexOf(backend) + (hasDrawn ? 0 : 1));
    this.drop();
    if (this.#photo && backends.length > 0) {
      void this.select(this.#photo, { ...options, backends }, previous, reason);
      return;
    }
    const message = `${reason} No other backend is left to try. Reload the page.`;
    this.events.failed(new PhotoError('backend-lost', message));
  }

  /** Sets a backend up, unless the active one already meets the options. */
  async #attempt(
    backend: Backend,
    options: BackendPreferences,
    photo: SharedPhoto,
    signal: AbortSignal,
  ): Promise<ActiveBackend> {
    const active = this.active;
    if (active?.photo === photo && active.lossReason === null && meets(active, backend, options)) {
      return active;
    }
    let created: ActiveBackend | null = null;
    let earlyLoss: string | null = null;
    const onLost = (reason: string): void => {
      if (created) this.lose(created, reason);
      else earlyLoss ??= reason;
    };
    try {
      const renderer = await this.createRenderer(backend, photo.value, options, onLost, signal);
      if (!signal.aborted && earlyLoss === null) {
        created = new ActiveBackend(backend, options, renderer, photo);
        return created;
      }
      renderer.free();
      throw signal.reason;
    } catch (thrown) {
      // The loss explains every other error.
      if (earlyLoss !== null) {
        const message = `it was lost while it was being set up: ${earlyLoss}`;
        throw new PhotoError('backend-lost', message, thrown);
      }
      const error = toPhotoError(thrown);
      // No other backend could use this photograph either; fetching it again ends the search.
      if (error.code === 'photo-lost' && !signal.aborted && photo.value.isComplete) {
        this.events.photoLost(error.message);
      }
      throw error;
    }
  }
}

function meets(active: ActiveBackend, backend: Backend, options: BackendPreferences): boolean {
  return (
    active.backend === backend &&
    active.options.gamut === options.gamut &&
    // A device that was allowed to be a software renderer may be one.
    (backend === 'cpu' || options.software || !active.options.software)
  );
}
