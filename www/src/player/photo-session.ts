/**
 * The life of one photograph on the page: loaded, given a back end, drawn under lights, let go.
 * Knows no DOM; the element gives it ports, tests give it fakes. At any moment there is at most one
 * load and one search for a back end under way, and whatever was begun for a setting that has
 * changed since is aborted and freed.
 */

import type { OutputSettings } from '../engine/output-settings.js';
import type { Backend } from '../engine/types.js';
import type { LightSetting } from '../lights/light-setting.js';
import { missingSource, type OnPreview, type OnProgress } from '../loading/load.js';
import type { Photograph } from '../photo/photograph.js';
import type { FrameResult, Renderer, RenderOptions } from '../renderers/types.js';
import { PhotoError, toPhotoError } from '../shared/errors.js';
import { Deferred } from '../shared/promises.js';
import { after, BACKEND_TITLES, firstWorking, from, sentence } from './backends.js';
import { Quality } from './quality.js';

/** All that attributes and the pointer say. */
export interface SessionSettings {
  /** Absolute address, or `null` where there is none. */
  readonly src: string | null;
  /** Whether cookies go along. */
  readonly credentials: RequestCredentials;
  readonly renderOptions: RenderOptions;
  readonly light: LightSetting;
  readonly output: OutputSettings;
}

/** What the session needs done. */
export interface SessionPorts<D extends Renderer> {
  open(
    src: string,
    credentials: RequestCredentials,
    signal: AbortSignal,
    onProgress: OnProgress,
    onPreview: OnPreview | null,
  ): Promise<Photograph>;
  /** Has what is likely to draw get ready while a photograph comes, and stay so until `over` is aborted. */
  prepare(renderOptions: RenderOptions, over: AbortSignal): void;
  /**
   * Sets a back end up on a surface of its own; throws `backend-unavailable`, or `photo-lost`. Need not
   * go on once `signal` is aborted.
   */
  draw(
    backend: Backend,
    photo: Photograph,
    renderOptions: RenderOptions,
    lost: (reason: string) => void,
    signal: AbortSignal,
  ): Promise<D>;
  /** Calls back before the browser draws next. */
  nextFrame(callback: () => void): void;
  /** Calls back once after so many milliseconds, unless what it gives is called first. */
  later(ms: number, callback: () => void): () => void;
  /** Milliseconds since any moment. */
  now(): number;
}

/** What the session tells. */
export interface SessionListener<D extends Renderer> {
  /** A load begins: what was shown is gone. */
  loadStarted(): void;
  progress: OnProgress;
  /** A drawing has its first frame, and is to be shown from now on. */
  rendererChanged(renderer: D): void;
  /** A frame was drawn, and this light asked for. */
  frameDrawn(frame: FrameResult, light: LightSetting): void;
  /** That frame is by another share of the photograph than the one before it; the first is by all. */
  qualityChanged(detail: number): void;
  /** The whole photograph is drawn for the first time, or the first since it had to be fetched anew. */
  loaded(): void;
  /** Another back end was taken up, or the same again after it was lost. */
  backendChanged(backend: Backend, previous: Backend | null, reason: string): void;
  /** The back end in use is gone. */
  backendLost(backend: Backend, reason: string): void;
  failed(error: PhotoError): void;
  /** Nothing is wrong any more. */
  recovered(): void;
}

/** A back end that was set up. */
class SetUp<D extends Renderer> {
  readonly backend: Backend;
  readonly renderOptions: RenderOptions;
  readonly renderer: D;
  readonly held: Held;
  readonly quality = new Quality();
  freed = false;
  /** Why it no longer works, once it does not. */
  lost: string | null = null;
  /** Whether it has drawn a frame. */
  drew = false;
  /** The one that is being drawn, where that takes time. */
  frame: Deferred | null = null;

  constructor(backend: Backend, renderOptions: RenderOptions, renderer: D, held: Held) {
    this.backend = backend;
    this.renderOptions = renderOptions;
    this.renderer = renderer;
    this.held = held;
    held.hold();
  }

  /** Once. */
  free(): void {
    if (this.freed) return;
    this.freed = true;
    this.renderer.free();
    this.held.release();
  }
}

/** A search for a back end. It has ended also once nobody wants it any more. */
class Search extends Deferred {
  readonly #abort = new AbortController();

  get signal(): AbortSignal {
    return this.#abort.signal;
  }

  abort(): void {
    this.#abort.abort();
    this.end();
  }
}

/** A photograph that is freed when the last of its holders lets go. */
class Held {
  readonly photo: Photograph;
  #holders = 1;

  constructor(photo: Photograph) {
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

/** A photograph that loses parts is fetched so often without a frame between. */
const MOST_FETCHES = 5;
/** A picture of which no newer frame is asked for so long after the browser's next is at rest. */
const REST_MS = 150;

/** See the module. */
export class PhotoSession<D extends Renderer> {
  readonly #ports: SessionPorts<D>;
  readonly #listener: SessionListener<D>;
  #settings: SessionSettings | null = null;
  #load: AbortController | null = null;
  #search: Search | null = null;
  #held: Held | null = null;
  #active: SetUp<D> | null = null;
  /** What is shown until `#active` has drawn. */
  #outgoing: SetUp<D> | null = null;
  /** The frame that is to follow what is under way. */
  #next: Promise<D> | null = null;
  /** How often what there was was let go: what waits then waits in vain. */
  #releases = 0;
  /** How often the photograph was fetched anew since it was last drawn. */
  #fetches = 0;
  /** Whether there is a picture of the photograph, and whether one of all of it. */
  #drawn = false;
  #loaded = false;
  #failed = false;
  /** The photograph did not come whole, which frames of what came do not mend. */
  #cutShort = false;
  #frameAsked = false;
  /** Whether a picture of this photograph is on the screen, be it of one that was let go. */
  #onScreen = false;
  /** What the listener was told to show last. */
  #shows: D | null = null;
  #visible = true;
  /** What was drawn last is out of date. */
  #stale = false;
  /** The next frame is to be in full detail, whatever the back end has time for. */
  #whole = false;
  /** The share of the photograph, and that of it that the back end has time for, in the last frame. */
  #detail = 1;
  #timeFor = 1;
  /** Keeps the picture from being drawn again once it is at rest. */
  #keepMoving = (): void => {};

  constructor(ports: SessionPorts<D>, listener: SessionListener<D>) {
    this.#ports = ports;
    this.#listener = listener;
  }

  /** The photograph, once decoded. */
  get photo(): Photograph | null {
    return this.#held?.photo ?? null;
  }

  /** The back end in use. */
  get backend(): Backend | null {
    return this.#active?.backend ?? null;
  }

  /** What is drawn on. */
  get renderer(): D | null {
    return this.#active?.renderer ?? null;
  }

  /** The share of the components that the picture is drawn by; `null` while there is none. */
  get quality(): number | null {
    return this.#active?.drew ? this.#detail : null;
  }

  /** Takes new settings. `reload` loads even where the address is the same. */
  set(settings: SessionSettings, reload = false): void {
    const before = this.#settings;
    this.#settings = settings;
    const sameFile = before?.src === settings.src && before.credentials === settings.credentials;
    if (!before || reload || !sameFile) {
      this.#begin(settings.src);
    } else if (!same(before.renderOptions, settings.renderOptions)) {
      void this.#choose(settings.renderOptions, this.backend, '');
    } else {
      this.#askForFrame();
    }
  }

  /** Draws again: the light is the same, but looks different. */
  redraw(): void {
    if (this.#held) this.#askForFrame();
  }

  /**
   * Whether anyone can see it. While nobody can, changes of light are not drawn, but the first picture
   * of a photograph is, and that of another back end, and what `renderNow` is asked for.
   */
  setVisible(visible: boolean): void {
    this.#visible = visible;
    if (!visible) this.#keepMoving();
    else if (this.#stale) this.#askForFrame();
    else if (this.#timeFor < 1) this.#awaitRest();
  }

  /** Lets everything go. */
  stop(): void {
    this.#settings = null;
    this.#release();
  }

  /**
   * Draws the settings there are, or newer ones, in full detail, and gives what was drawn on. At once,
   * unless a frame or a search for a back end is under way: those asked for meanwhile are one, the next,
   * by whatever back end there is then. Rejects where there is nothing to draw, and where drawing fails.
   */
  renderNow(): Promise<D> {
    this.#whole = true;
    return this.#renderSoon();
  }

  #renderSoon(): Promise<D> {
    if (!this.#next && !this.#busy) return this.#draw();
    this.#next ??= this.#drawNext();
    return this.#next;
  }

  /**
   * What drawing waits for: a frame in the middle of a search would take back tiles that were moved for
   * the back end that is found.
   */
  get #busy(): Promise<void> | undefined {
    return (this.#search ?? this.#active?.frame)?.ended;
  }

  async #drawNext(): Promise<D> {
    const releases = this.#releases;
    while (this.#busy) {
      await this.#busy;
      // A finer photograph in the place of a coarser one is drawn all the same.
      if (this.#releases !== releases) throw notLoaded();
    }
    this.#next = null;
    return await this.#draw();
  }

  async #draw(): Promise<D> {
    const active = this.#active;
    const releases = this.#releases;
    const whole = this.#whole;
    this.#whole = false;
    if (!active || !this.#settings) throw notLoaded();
    const { light, output } = this.#settings;
    const detail = whole ? 1 : active.quality.detail;
    this.#stale = false;
    this.#keepMoving();
    try {
      const began = this.#ports.now();
      let drawn = active.renderer.render(light, output, detail);
      if (!whole) this.#clock(active, began, drawn);
      if (drawn instanceof Promise) {
        active.frame = new Deferred();
        drawn = await drawn;
      }
      if (active.held.photo.share === 1) this.#fetches = 0;
      active.drew = true;
      // Another light may have been set meanwhile, with which nothing is wrong.
      const sameLight = light.image === this.#settings?.light.image;
      const told = sameLight ? drawn : { ...drawn, lightError: null };
      if (active === this.#active) this.#tell(active, told, light, detail);
      return active.renderer;
    } catch (thrown) {
      if (active === this.#active && active.freed) {
        // The photograph that is there by now draws.
        this.#whole ||= whole;
        return this.#renderSoon();
      }
      if (active !== this.#active) {
        // What becomes of one that has been let go is nobody's concern. What comes in its place draws.
        if (releases !== this.#releases || !this.#search) throw notLoaded(thrown);
        this.#whole ||= whole;
        return this.#renderSoon();
      }
      const error = toPhotoError(thrown);
      this.#stopped(active, error);
      throw error;
    } finally {
      // Last, so that whoever waits finds all of it done.
      active.frame?.end();
      active.frame = null;
    }
  }

  /** A frame of a motion has begun. */
  #clock({ quality }: SetUp<D>, began: number, renderer: FrameResult | Promise<FrameResult>): void {
    const drew = () => quality.drew(began, this.#ports.now());
    if (renderer instanceof Promise) renderer.then(drew, () => {});
    // A graphics device is still at it, and holds up the browser's next frame.
    else this.#ports.nextFrame(drew);
    // What a page changes in its own turn before that frame is in time for it.
    this.#awaitFrame();
  }

  #tell(
    { renderer, held }: SetUp<D>,
    drawn: FrameResult,
    light: LightSetting,
    timeFor: number,
  ): void {
    const detail = timeFor * held.photo.share;
    const changed = detail !== this.#detail;
    this.#detail = detail;
    this.#timeFor = timeFor;
    if (timeFor < 1 && !this.#stale && !this.#unseen) this.#awaitRest();
    if (this.#shows !== renderer) {
      this.#shows = renderer;
      this.#onScreen = true;
      this.#listener.rendererChanged(renderer);
      this.#outgoing?.free();
      this.#outgoing = null;
    }
    this.#listener.frameDrawn(drawn, light);
    if (changed) this.#listener.qualityChanged(detail);
  }

  /** Draws once more, in full detail, unless a newer frame comes first. */
  #awaitRest(): void {
    this.#keepMoving();
    let moves = false;
    this.#keepMoving = () => {
      moves = true;
    };
    // Pages and pointers ask with the browser's frames. Where these are late, it is not yet at rest.
    this.#ports.nextFrame(() => {
      if (moves) return;
      this.#keepMoving = this.#ports.later(REST_MS, () => this.#renderWhole());
    });
  }

  /** A frame could not be drawn. */
  #stopped(active: SetUp<D>, error: PhotoError): void {
    if (error.code === 'backend-lost') this.#lost(active, error.message);
    else if (error.code !== 'photo-lost') this.#fail(error);
    else if (active.held.photo.share === 1) this.#fetchAnew(error.message);
    // What was lost is about to be replaced.
    else this.#dropActive();
  }

  #begin(src: string | null): void {
    this.#release();
    this.#fetches = 0;
    this.#onScreen = false;
    this.#listener.loadStarted();
    if (src === null) {
      this.#fail(missingSource());
      return;
    }
    void this.#run(src, null, '');
  }

  /** Loads a photograph again of which parts are gone. Its picture is left until it is there. */
  #fetchAnew(reason: string): void {
    const src = this.#settings?.src;
    const previous = this.backend;
    const failed = this.#failed;
    this.#release();
    if (this.#fetches === MOST_FETCHES) {
      const vain = `It was fetched ${MOST_FETCHES} times again, in vain.`;
      this.#fail(new PhotoError('photo-lost', `${reason} ${vain}`));
      return;
    }
    this.#fetches += 1;
    this.#failed = failed;
    if (src) void this.#run(src, previous, reason);
  }

  /** Loads, and takes up a back end in the place of `previous`; `why` tells what became of that one. */
  async #run(src: string, previous: Backend | null, why: string): Promise<void> {
    const load = new AbortController();
    this.#load = load;
    const { signal } = load;
    const drawn = new AbortController();
    if (this.#settings) this.#ports.prepare(this.#settings.renderOptions, drawn.signal);
    const onPreview: OnPreview = (preview) => {
      // While the last one is on its way to the screen, none comes in its place.
      if (signal.aborted || this.#search) preview.free();
      else void this.#take(preview, previous, why);
    };
    try {
      const photo = await this.#ports.open(
        src,
        this.#settings?.credentials ?? 'same-origin',
        signal,
        (loaded, total) => {
          if (!signal.aborted) this.#listener.progress(loaded, total);
        },
        // What is on the screen is finer than what comes first.
        this.#onScreen ? null : onPreview,
      );
      // Who draws the coarser one has all that this one needs as well, and nothing is asked for twice.
      while (this.#search && !signal.aborted) await this.#search.ended;
      if (signal.aborted) {
        photo.free();
        return;
      }
      this.#load = null;
      await this.#take(photo, previous, why);
    } catch (thrown) {
      if (signal.aborted) return;
      this.#cutShort = true;
      this.#fail(toPhotoError(thrown));
      return;
    } finally {
      drawn.abort();
      if (this.#load === load) this.#load = null;
    }
  }

  /** Has a photograph drawn from now on: the whole one, or a coarser one until that is there. */
  async #take(photo: Photograph, previous: Backend | null, why: string): Promise<void> {
    this.#held?.release();
    this.#held = new Held(photo);
    const { backend } = this;
    // On the CPU nothing of it is needed for its picture to stay, and memory may be for one only.
    if (backend === 'cpu') this.#active?.free();
    if (!this.#settings) return;
    const { renderOptions } = this.#settings;
    // What could not draw the one before will not draw this one.
    const backends = backend ? from(renderOptions.backends, backend) : renderOptions.backends;
    await this.#choose({ ...renderOptions, backends }, backend ?? previous, backend ? '' : why);
  }

  /**
   * Takes up the first back end of `order` that works, in the place of `previous`; `why` tells what
   * became of that one. Does nothing before the photograph is there: its load will search.
   */
  async #choose(
    renderOptions: RenderOptions,
    previous: Backend | null,
    why: string,
  ): Promise<void> {
    this.#search?.abort();
    const held = this.#held;
    if (!held) return;
    const search = new Search();
    const { signal } = search;
    this.#search = search;
    // Setting a back end up reads the photograph, even when nobody wants the result any more.
    held.hold();
    try {
      const chosen = await firstWorking(
        renderOptions.backends,
        (backend) => this.#setUp(backend, renderOptions, held, signal),
        () => signal.throwIfAborted(),
      );
      signal.throwIfAborted();
      this.#search = null;
      const found = chosen.value;
      const changed = found !== this.#active;
      const again = why !== '' || (this.#active?.lost ?? null) !== null;
      if (changed) this.#replaceActive(found);
      const reason = [why, chosen.reason, found.renderer.warning].filter(Boolean).join(' ');
      if (found.lost !== null) {
        this.#replace(found, found.lost, renderOptions, previous, reason);
        return;
      }
      // The same for another gamut is nothing new.
      if (changed && (found.backend !== previous || again)) {
        this.#listener.backendChanged(found.backend, previous, reason);
      }
      this.#renderWhole();
    } catch (thrown) {
      if (signal.aborted) return;
      this.#search = null;
      // The whole photograph will tell.
      if (held.photo.share < 1) {
        if (this.#active?.freed) this.#active = null;
        return;
      }
      this.#dropActive();
      const { code, message } = toPhotoError(thrown);
      this.#fail(new PhotoError(code, why ? `${why} ${message}` : message, thrown));
    } finally {
      search.end();
      held.release();
    }
  }

  /** One back end, set up, or the one in use where it is the same and works. */
  async #setUp(
    backend: Backend,
    renderOptions: RenderOptions,
    held: Held,
    signal: AbortSignal,
  ): Promise<SetUp<D>> {
    const { photo } = held;
    const active = this.#active;
    const serves =
      active?.held === held &&
      active.backend === backend &&
      active.renderOptions.gamut === renderOptions.gamut &&
      // Nobody knows here whether a device that might be a program is one.
      (backend === 'cpu' || renderOptions.software || !active.renderOptions.software);
    if (active && serves && active.lost === null) return active;
    let done: SetUp<D> | null = null;
    let lostEarly: string | null = null;
    const lost = (reason: string): void => {
      if (done) this.#lost(done, reason);
      else lostEarly ??= reason;
    };
    const setUp = this.#ports.draw(backend, photo, renderOptions, lost, signal);
    const renderer = await setUp.catch((thrown: unknown) => {
      // Whatever else went wrong, this is why.
      if (lostEarly !== null) throw lostInSetUp(lostEarly, thrown);
      const error = toPhotoError(thrown);
      // Nor could any other back end be set up. This ends the search.
      const whole = photo.share === 1;
      if (error.code === 'photo-lost' && !signal.aborted && whole) this.#fetchAnew(error.message);
      throw error;
    });
    if (signal.aborted) {
      renderer.free();
      signal.throwIfAborted();
    }
    if (lostEarly !== null) {
      renderer.free();
      throw lostInSetUp(lostEarly);
    }
    done = new SetUp(backend, renderOptions, renderer, held);
    return done;
  }

  #askForFrame(): void {
    this.#stale = true;
    this.#keepMoving();
    this.#awaitFrame();
  }

  /** Draws before the browser does, if there is something new by then. */
  #awaitFrame(): void {
    if (this.#frameAsked || this.#unseen) return;
    this.#frameAsked = true;
    this.#ports.nextFrame(() => {
      this.#frameAsked = false;
      if (this.#stale && !this.#unseen) this.#render();
    });
  }

  /** Nobody can see that the picture is out of date. */
  get #unseen(): boolean {
    return this.#drawn && !this.#visible;
  }

  #renderWhole(): void {
    this.#whole = true;
    this.#render();
  }

  #render(): void {
    // While a back end is being looked for, the one found will draw.
    if (!this.#held || !this.#active || this.#search) return;
    const active = this.#active;
    void this.#renderSoon().then(
      () => {
        if (this.#active === active) this.#shown();
      },
      () => {}, // told already
    );
  }

  #shown(): void {
    if (this.#failed && !this.#cutShort) {
      this.#failed = false;
      this.#listener.recovered();
    }
    this.#drawn = true;
    if (!this.#loaded && this.#held?.photo.share === 1) {
      this.#loaded = true;
      this.#listener.loaded();
    }
  }

  /**
   * A back end that stopped working is set up anew, or replaced by the next of the order where it cannot
   * be had any more, or never drew a frame. While one is being looked for, that search goes on, and what
   * it finds is the replacement.
   */
  #lost(lost: SetUp<D>, reason: string): void {
    const early = lost.lost === null;
    lost.lost ??= reason;
    if (early && this.#active === lost) this.#listener.backendLost(lost.backend, reason);
    if (this.#active !== lost || this.#search || !this.#settings) return;
    this.#replace(lost, reason, this.#settings.renderOptions, lost.backend, '');
  }

  /** Takes up a lost back end anew, or what comes after it, in the place of `previous`. */
  #replace(
    { backend, drew }: SetUp<D>,
    reason: string,
    renderOptions: RenderOptions,
    previous: Backend | null,
    before: string,
  ): void {
    this.#dropActive();
    const lost = sentence(`${BACKEND_TITLES[backend]} was lost: ${reason}`);
    const why = [before, lost].filter(Boolean).join(' ');
    const backends = drew
      ? from(renderOptions.backends, backend)
      : after(renderOptions.backends, backend);
    if (backends.length > 0) void this.#choose({ ...renderOptions, backends }, previous, why);
    else
      this.#fail(
        new PhotoError('backend-lost', `${why} No other back end is left to try. Reload the page.`),
      );
  }

  #fail(error: PhotoError): void {
    this.#failed = true;
    this.#listener.failed(error);
  }

  #dropActive(): void {
    this.#keepMoving();
    this.#active?.free();
    this.#active = null;
    this.#outgoing?.free();
    this.#outgoing = null;
  }

  /** Takes something else up. What is shown stays until that has drawn. */
  #replaceActive(found: SetUp<D>): void {
    this.#keepMoving();
    const active = this.#active;
    this.#active = found;
    if (!active) return;
    if (active.renderer === this.#shows && active.lost === null) this.#outgoing = active;
    else active.free();
  }

  #release(): void {
    this.#releases += 1;
    this.#load?.abort();
    this.#load = null;
    this.#search?.abort();
    this.#search = null;
    this.#next = null;
    this.#dropActive();
    this.#held?.release();
    this.#held = null;
    this.#drawn = false;
    this.#loaded = false;
    this.#shows = null;
    this.#failed = false;
    this.#cutShort = false;
    this.#stale = false;
    this.#whole = false;
  }
}

function lostInSetUp(reason: string, cause?: unknown): PhotoError {
  const message = `it was lost while it was being set up: ${reason}`;
  return new PhotoError('backend-lost', message, cause);
}

function notLoaded(cause?: unknown): PhotoError {
  const message = 'The photograph is not loaded yet: wait for its load event.';
  return new PhotoError('not-loaded', message, cause);
}

function same(a: RenderOptions, b: RenderOptions): boolean {
  const order = [a, b].map(({ backends }) => backends.join());
  return order[0] === order[1] && a.software === b.software && a.gamut === b.gamut;
}
