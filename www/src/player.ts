/**
 * The life of one photograph on the page: loaded, given a back end, drawn under lights, let go.
 * Knows no DOM; the element gives it ports, tests give it fakes. At any moment there is at most one
 * load and one search for a back end under way, and whatever was begun for a setting that has
 * changed since is aborted and freed.
 */

import { after, BACKEND_TITLES, firstWorking } from './backends.js';
import type { Backend, Freeable, Photo } from './engine.js';
import { PhotoError, toPhotoError } from './errors.js';
import { missingSource, type OnProgress } from './load.js';
import type { LightName, PicturePoint } from './settings.js';

/** A built-in light; a torch may have been moved to a point of the picture. */
export interface LightSetting {
  readonly name: LightName;
  readonly torch: PicturePoint | null;
}

/** All that attributes and the pointer say. */
export interface Settings {
  /** Absolute address, or `null` where there is none. */
  readonly src: string | null;
  readonly backends: readonly Backend[];
  readonly light: LightSetting;
  readonly exposure: number;
}

/** A photograph on a surface, ready to be drawn. */
export interface Drawing extends Freeable {
  readonly kernel: string;
  /** Draws at once, or throws `backend-lost`. */
  render(light: LightSetting, exposure: number): void;
}

/** What the player needs done. */
export interface Ports<D extends Drawing> {
  open(src: string, signal: AbortSignal, onProgress: OnProgress): Promise<Photo>;
  /** Sets a back end up on a surface of its own; throws `backend-unavailable`. */
  draw(backend: Backend, photo: Photo, lost: (reason: string) => void): Promise<D>;
  /** Calls back before the browser draws next. */
  nextFrame(callback: () => void): void;
}

/** What the player tells. */
export interface Listener<D extends Drawing> {
  /** A load begins: what was shown is gone. */
  loading(): void;
  progress: OnProgress;
  /** The photograph is drawn for the first time. */
  loaded(photo: Photo): void;
  /** A back end was taken up; `drawing` is to be shown from now on. */
  backendChanged(drawing: D, backend: Backend, previous: Backend | null, reason: string): void;
  failed(error: PhotoError): void;
  /** Nothing is wrong any more. */
  recovered(): void;
}

/** A back end that was set up. */
interface SetUp<D extends Drawing> {
  readonly backend: Backend;
  readonly drawing: D;
  /** Why it no longer works, once it does not. */
  lost: string | null;
}

/** A photograph that is freed when the last of its holders lets go. */
class Held {
  readonly photo: Photo;
  #holders = 1;

  constructor(photo: Photo) {
    this.photo = photo;
  }

  hold(): void {
    this.#holders += 1;
  }

  release(): void {
    this.#holders -= 1;
    if (this.#holders === 0) this.photo.free();
  }
}

/** See the module. */
export class Player<D extends Drawing> {
  readonly #ports: Ports<D>;
  readonly #listener: Listener<D>;
  #settings: Settings | null = null;
  #load: AbortController | null = null;
  #search: AbortController | null = null;
  #held: Held | null = null;
  #active: SetUp<D> | null = null;
  #drawn = false;
  #failed = false;
  #frameAsked = false;

  constructor(ports: Ports<D>, listener: Listener<D>) {
    this.#ports = ports;
    this.#listener = listener;
  }

  /** The photograph, once decoded. */
  get photo(): Photo | null {
    return this.#held?.photo ?? null;
  }

  /** The back end in use. */
  get backend(): Backend | null {
    return this.#active?.backend ?? null;
  }

  /** What is drawn on. */
  get drawing(): D | null {
    return this.#active?.drawing ?? null;
  }

  /** Takes new settings. `reload` loads even where the address is the same. */
  set(settings: Settings, reload = false): void {
    const before = this.#settings;
    this.#settings = settings;
    if (!before || reload || before.src !== settings.src) {
      this.#begin(settings.src);
    } else if (!sameOrder(before.backends, settings.backends)) {
      void this.#choose(settings.backends, this.backend, '');
    } else {
      this.#askForFrame();
    }
  }

  /** Lets everything go. */
  stop(): void {
    this.#settings = null;
    this.#release();
  }

  /** Draws now. Throws where there is nothing to draw, and where drawing fails. */
  renderNow(): D {
    if (!this.#active || !this.#settings) {
      throw new PhotoError(
        'not-loaded',
        'The photograph is not loaded yet: wait for its load event.',
      );
    }
    const active = this.#active;
    const { drawing } = active;
    try {
      drawing.render(this.#settings.light, this.#settings.exposure);
      return drawing;
    } catch (thrown) {
      const error = toPhotoError(thrown);
      if (error.code === 'backend-lost') this.#lost(active, error.message);
      else this.#fail(error);
      throw error;
    }
  }

  #begin(src: string | null): void {
    this.#release();
    this.#listener.loading();
    if (src === null) {
      this.#fail(missingSource());
      return;
    }
    const load = new AbortController();
    this.#load = load;
    void this.#run(src, load);
  }

  async #run(src: string, load: AbortController): Promise<void> {
    const { signal } = load;
    try {
      const photo = await this.#ports.open(src, signal, (loaded, total) => {
        if (!signal.aborted) this.#listener.progress(loaded, total);
      });
      if (signal.aborted) {
        photo.free();
        return;
      }
      this.#held = new Held(photo);
    } catch (thrown) {
      if (!signal.aborted) this.#fail(toPhotoError(thrown));
      return;
    } finally {
      if (this.#load === load) this.#load = null;
    }
    if (this.#settings) await this.#choose(this.#settings.backends, null, '');
  }

  /**
   * Takes up the first back end of `order` that works, in the place of `previous`; `why` tells what
   * became of that one. Does nothing before the photograph is there: its load will search.
   */
  async #choose(order: readonly Backend[], previous: Backend | null, why: string): Promise<void> {
    this.#search?.abort();
    const held = this.#held;
    if (!held) return;
    const search = new AbortController();
    const { signal } = search;
    this.#search = search;
    // Setting a back end up reads the photograph, even when nobody wants the result any more.
    held.hold();
    try {
      const chosen = await firstWorking(
        order,
        (backend) => this.#setUp(backend, held.photo, signal),
        () => signal.throwIfAborted(),
      );
      signal.throwIfAborted();
      this.#search = null;
      const found = chosen.value;
      const changed = found !== this.#active;
      if (changed) {
        this.#dropActive();
        this.#active = found;
      }
      const reason = [why, chosen.reason].filter(Boolean).join(' ');
      if (found.lost !== null) {
        this.#replace(found, found.lost, order, previous, reason);
        return;
      }
      if (changed) {
        this.#listener.backendChanged(found.drawing, found.backend, previous, reason);
      }
      this.#render();
    } catch (thrown) {
      if (signal.aborted) return;
      this.#search = null;
      this.#dropActive();
      this.#fail(toPhotoError(thrown));
    } finally {
      held.release();
    }
  }

  /** One back end, set up, or the one in use where it is the same and works. */
  async #setUp(backend: Backend, photo: Photo, signal: AbortSignal): Promise<SetUp<D>> {
    if (this.#active?.backend === backend && this.#active.lost === null) return this.#active;
    let done: SetUp<D> | null = null;
    let lostEarly: string | null = null;
    const drawing = await this.#ports.draw(backend, photo, (reason) => {
      if (done) this.#lost(done, reason);
      else lostEarly ??= reason;
    });
    if (signal.aborted) {
      drawing.free();
      signal.throwIfAborted();
    }
    if (lostEarly !== null) {
      drawing.free();
      throw new PhotoError('backend-lost', `it was lost while it was being set up: ${lostEarly}`);
    }
    done = { backend, drawing, lost: null };
    return done;
  }

  #askForFrame(): void {
    if (this.#frameAsked) return;
    this.#frameAsked = true;
    this.#ports.nextFrame(() => {
      this.#frameAsked = false;
      this.#render();
    });
  }

  #render(): void {
    // While a back end is being looked for, the one found will draw.
    if (!this.#held || !this.#active || this.#search) return;
    try {
      this.renderNow();
    } catch {
      return; // told already
    }
    if (this.#failed) {
      this.#failed = false;
      this.#listener.recovered();
    }
    if (!this.#drawn) {
      this.#drawn = true;
      this.#listener.loaded(this.#held.photo);
    }
  }

  /**
   * A back end that stopped working is replaced by the next of the order. While one is being looked
   * for, that search goes on, and what it finds is the replacement.
   */
  #lost(lost: SetUp<D>, reason: string): void {
    lost.lost ??= reason;
    if (this.#active !== lost || this.#search || !this.#settings) return;
    this.#replace(lost, reason, this.#settings.backends, lost.backend, '');
  }

  /** Takes up what comes after a lost back end, in the place of `previous`. */
  #replace(
    { backend }: SetUp<D>,
    reason: string,
    order: readonly Backend[],
    previous: Backend | null,
    before: string,
  ): void {
    this.#dropActive();
    const rest = after(order, backend);
    const lost = `${BACKEND_TITLES[backend]} was lost: ${reason}`;
    const why = [before, lost].filter(Boolean).join(' ');
    if (rest.length > 0) void this.#choose(rest, previous, why);
    else this.#fail(new PhotoError('backend-lost', `${why} No other back end is left to try.`));
  }

  #fail(error: PhotoError): void {
    this.#failed = true;
    this.#listener.failed(error);
  }

  #dropActive(): void {
    this.#active?.drawing.free();
    this.#active = null;
  }

  #release(): void {
    this.#load?.abort();
    this.#load = null;
    this.#search?.abort();
    this.#search = null;
    this.#dropActive();
    this.#held?.release();
    this.#held = null;
    this.#drawn = false;
    this.#failed = false;
  }
}

function sameOrder(a: readonly Backend[], b: readonly Backend[]): boolean {
  return a.length === b.length && a.every((backend, i) => backend === b[i]);
}
