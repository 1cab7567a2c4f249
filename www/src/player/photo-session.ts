/**
 * One photograph on the page: it is loaded, given a backend, drawn and released. Ports stand for the browser.
 *
 *     set ─▶ load ─▶ preview or photograph ─▶ BackendSelector ─▶ renderer ─▶ frames (FrameScheduler)
 *             ▲                                   │ photo-lost, or rested
 *             └───────────────────────────────────┘
 *
 * The photograph is the page library's, which elements share. The library may ask a session out of view to rest: the
 * session releases the photograph and keeps its picture, until it comes near or a script needs the photograph.
 *
 * Each load has a signal, which is aborted when another load starts or the session stops. Whatever continues after a
 * wait checks it, and frees its result if it has come too late.
 */

import type { Backend } from '../engine/wasm-exports.js';
import type { AppliedLightStatus } from '../lights/light-cache.js';
import type { LightSetting } from '../lights/light-setting.js';
import { OUT_OF_VIEW } from '../photo/load-queue.js';
import type { PhotoUser, SharedPhoto } from '../photo/photo-library.js';
import type { LoadedPhotograph } from '../photo/photograph.js';
import type { Renderer } from '../renderers/types.js';
import { PhotoError, toPhotoError } from '../shared/errors.js';
import { Deferred } from '../shared/promises.js';
import type { ActiveBackend } from './active-backend.js';
import { BackendSelector } from './backend-selector.js';
import { FrameScheduler } from './frame-scheduler.js';
import type { PhotoSessionListener, SessionPorts, SessionSettings } from './types.js';

/** How often a photograph that loses tiles is fetched again without a frame in between. */
const MAX_REFETCHES = 5;
/** Maximum side of the resting picture of a photograph of several levels, in pixels. */
const MAX_RESTING_SIDE = 1024;

/** What is known of a photograph that was released while its picture stays. */
interface RestingPicture {
  readonly photo: Pick<LoadedPhotograph, 'info'>;
  readonly renderer: Pick<Renderer, 'kernel' | 'gamut'>;
  readonly backend: Backend;
}

export class PhotoSession {
  readonly #selector: BackendSelector;
  readonly #scheduler: FrameScheduler;
  /** `null` while it is stopped. */
  settings: SessionSettings | null = null;
  /** Whether a frame of the whole photograph was drawn; previews are drawn before. */
  isLoaded = false;
  /** Whether an overview copies the canvas. */
  hasOverview = false;
  /** A failed load is permanent: frames, which are of a preview then, do not repair it. */
  #failure: 'temporary' | 'permanent' | null = null;
  /** Aborted when the load and its photograph are released. */
  #load = new AbortController();
  #photo: SharedPhoto | null = null;
  /** Set from the release until the photograph is drawn again. */
  #resting: RestingPicture | null = null;
  /** The load that ends the rest. */
  #wake: { readonly signal: AbortSignal; readonly done: Promise<void> } | null = null;
  /** Calls of `renderNow` that wait for the end of the rest. */
  #requests = 0;
  #isVisible = true;
  /** Fetches since the photograph was last drawn. */
  #refetches = 0;
  /** The frame after the one, or the search, that is in progress. */
  #nextFrame: Promise<Renderer> | null = null;
  /** The next frame has full quality, even if the device is slow. */
  #isFullQualityRequested = false;
  #quality = 1;

  constructor(
    private readonly ports: SessionPorts,
    private readonly listener: PhotoSessionListener,
  ) {
    this.#selector = new BackendSelector(ports.createRenderer, listener, {
      failed: (error) => this.#fail(error),
      selected: () => this.#drawFrame(true),
      photoLost: (reason) => this.#refetch(reason),
    });
    this.#scheduler = new FrameScheduler(ports, (isFullQuality) => this.#drawFrame(isFullQuality));
  }

  /** The photograph, or its preview, once it is decoded. */
  get photo(): Pick<LoadedPhotograph, 'info'> | null {
    return this.#photo?.value ?? this.#resting?.photo ?? null;
  }

  get backend(): Backend | null {
    return this.#selector.active?.backend ?? this.#resting?.backend ?? null;
  }

  get renderer(): Pick<Renderer, 'kernel' | 'gamut'> | null {
    return this.#selector.active?.renderer ?? this.#resting?.renderer ?? null;
  }

  /** The share of the photograph's components in the last frame; `null` before the first. */
  get quality(): number | null {
    return this.#selector.active?.hasDrawn || this.#resting ? this.#quality : null;
  }

  /** A changed setting is a new object. `reload` fetches the file even if its address is the same. */
  set(settings: SessionSettings, reload = false): void {
    const previous = this.settings;
    this.settings = settings;
    this.#selector.options = settings.backendOptions;
    const isSameFile =
      previous?.src === settings.src && previous.credentials === settings.credentials;
    if (!previous || reload || !isSameFile) {
      this.#release(false);
      this.#refetches = 0;
      this.listener.loadStarted();
      void this.#run(settings, null, '', isSameFile);
    } else if (previous.backendOptions === settings.backendOptions) {
      this.#scheduler.invalidate();
    } else if (this.#photo) {
      void this.#selector.select(this.#photo, settings.backendOptions, this.backend, '');
    }
  }

  /** Draws again, because the content of the light has changed. */
  redraw(): void {
    if (this.#photo) this.#scheduler.invalidate();
  }

  /** An invisible picture is drawn for the first time, for another backend and by `renderNow`, but not for changes. */
  setVisible(isVisible: boolean): void {
    this.#isVisible = isVisible;
    this.#scheduler.setVisible(isVisible);
    if (isVisible) this.#startWake();
    this.ports.library.update();
  }

  /** The element has come within a screen of the viewport, or has left it. */
  setNear(isNear: boolean): void {
    if (isNear) this.#startWake();
    else if (this.#resting && !this.#photo && this.#requests === 0) this.#abortLoad();
    this.ports.library.update();
  }

  stop(): void {
    this.settings = null;
    this.#release(false);
  }

  /**
   * Draws the current settings in full quality and gives the renderer. It waits for a frame or a backend search in
   * progress; all requests made meanwhile get the same frame. Rejects with `not-loaded` if there is no photograph, and
   * with the error of a frame that fails.
   */
  async renderNow(): Promise<Renderer> {
    if (this.#resting && !this.#photo) {
      this.#requests += 1;
      this.#startWake();
      this.ports.library.update();
      await this.#wake?.done;
      this.#requests -= 1;
    }
    this.#isFullQualityRequested = true;
    return this.#renderNext();
  }

  /** Releases the photograph; its picture stays. */
  #rest(): void {
    const { active } = this.#selector;
    const { settings } = this;
    if (!active || !settings) return;
    const { backend, renderer } = active;
    if (backend !== 'cpu' || renderer.snapshot) {
      // The canvas of a graphics device keeps its picture only until the script ends.
      try {
        if (backend !== 'cpu') void renderer.render(settings.light, settings.output, 1);
        const canvas = renderer.snapshot?.(MAX_RESTING_SIDE) ?? this.ports.copyCanvas(renderer);
        this.listener.rendererChanged({ canvas });
      } catch {
        return;
      }
    }
    const { kernel, gamut } = renderer;
    const { info } = active.photo.value;
    this.#release(true);
    this.#resting = { photo: { info }, renderer: { kernel, gamut }, backend };
    this.isLoaded = true;
  }

  /** Opens the photograph of a resting picture again, unless it is being opened or drawn. */
  #startWake(): void {
    const { signal } = this.#load;
    const { active, search } = this.#selector;
    const isAwake = active || search || this.#wake?.signal === signal;
    if (!this.#resting || !this.settings || isAwake) return;
    const done = this.#run(this.settings, this.#resting.backend, '').finally(() => {
      // After a failure, the next one tries again.
      if (this.#wake?.signal === signal) this.#wake = null;
    });
    this.#wake = { signal, done };
  }

  /** The session as a user of the library, while the current load and its photograph last. */
  #createUser(previous: Backend | null, reason: string): PhotoUser {
    const session = this;
    // After a loss or a rest, the picture on the screen is finer than a preview.
    const needsPreviews = !this.#scheduler.hasPicture;
    return {
      get placement() {
        return session.#requests > 0 ? 0 : session.listener.placement;
      },
      get isResting() {
        return session.#resting !== null && session.#requests === 0;
      },
      get wantsPreviews() {
        // The last preview must be drawn first.
        return needsPreviews && !session.#selector.search && this.placement < OUT_OF_VIEW;
      },
      get canRest() {
        return session.#canRest;
      },
      progress: (loaded, total) => {
        if (!session.#resting) session.listener.progress(loaded, total);
      },
      preview: (photo) => {
        photo.retain();
        void session.#use(photo, previous, reason);
      },
      rest: () => session.#rest(),
    };
  }

  /** Whether the picture of a photograph that was released is on the screen. */
  get #isBehindPicture(): boolean {
    return this.#scheduler.hasPicture && (this.#refetches > 0 || this.#resting !== null);
  }

  get #canRest(): boolean {
    const isBusy = this.#requests > 0 || this.#nextFrame || this.#inProgress;
    return !this.#isVisible && this.isLoaded && !isBusy && this.#selector.active?.hasDrawn === true;
  }

  /** Fetches a photograph that has lost tiles again. Its picture stays until the new one is drawn. */
  #refetch(reason: string): void {
    const settings = this.settings;
    const previous = this.backend;
    const hasFailed = this.#failure !== null;
    this.#release(true);
    if (this.#refetches === MAX_REFETCHES) {
      const summary = `The photograph was fetched ${MAX_REFETCHES} more times without success. Reload the page.`;
      const error = new PhotoError('photo-lost', `${reason} ${summary}`);
      this.#fail(error);
      return;
    }
    this.#refetches += 1;
    if (hasFailed) this.#failure = 'temporary';
    if (settings) void this.#run(settings, previous, reason);
  }

  /** Loads a file, and has it and its previews drawn. `reason` says why `previous` is replaced. */
  async #run(
    { src, credentials, backendOptions }: SessionSettings,
    previous: Backend | null,
    reason: string,
    isReload = false,
  ): Promise<void> {
    const { signal } = this.#load;
    const preparation = new AbortController();
    try {
      if (src === null) {
        const message = 'There is no photograph to show: set the src attribute.';
        throw new PhotoError('src-missing', message);
      }
      this.ports.prepare(backendOptions, preparation.signal);
      const user = this.#createUser(previous, reason);
      const { library } = this.ports;
      const photo = await library.open({ src, credentials }, user, signal, isReload);
      // The backend that the preview's search finds is used for the photograph as well.
      while (this.#selector.search && !signal.aborted) await this.#selector.search;
      if (signal.aborted) photo.release();
      else await this.#use(photo, previous, reason);
    } catch (thrown) {
      if (signal.aborted) return;
      this.#failure = this.#isBehindPicture ? 'temporary' : 'permanent';
      this.#fail(toPhotoError(thrown));
    } finally {
      preparation.abort();
    }
  }

  async #use(photo: SharedPhoto, previous: Backend | null, reason: string): Promise<void> {
    const backend = this.#selector.active?.backend;
    this.#photo?.release();
    this.#photo = photo;
    // The canvas of the CPU keeps its picture by itself, and memory may suffice for one photograph only.
    if (backend === 'cpu') this.#selector.active?.free();
    const options = this.settings?.backendOptions;
    if (!options) return;
    if (!backend) return this.#selector.select(photo, options, previous, reason);
    // Backends that could not draw the preview are not tried again.
    const backends = options.backends.slice(options.backends.indexOf(backend));
    return this.#selector.select(photo, { ...options, backends }, backend, '');
  }

  #drawFrame(isFullQuality: boolean): void {
    this.#isFullQualityRequested ||= isFullQuality;
    const { active, search } = this.#selector;
    // A search draws when it ends.
    if (!active || search) return;
    void this.#renderNext().then(
      () => {
        if (this.#selector.active === active) this.#recover();
      },
      () => {}, // reported in #render
    );
  }

  #renderNext(): Promise<Renderer> {
    if (!this.#nextFrame && !this.#inProgress) return this.#render();
    this.#nextFrame ??= this.#renderAfterWait();
    return this.#nextFrame;
  }

  /** What the next frame waits for. A frame during a search would take back tiles that the new backend needs. */
  get #inProgress(): Promise<void> | undefined {
    return this.#selector.search ?? this.#selector.active?.frame?.promise;
  }

  async #renderAfterWait(): Promise<Renderer> {
    const { signal } = this.#load;
    while (this.#inProgress) {
      await this.#inProgress;
      if (signal.aborted) throw notLoaded();
    }
    this.#nextFrame = null;
    return await this.#render();
  }

  async #render(): Promise<Renderer> {
    const { signal } = this.#load;
    const { active } = this.#selector;
    const isFullQuality = this.#isFullQualityRequested;
    this.#isFullQualityRequested = false;
    if (!active || !this.settings) throw notLoaded();
    const { light, output } = this.settings;
    const quality = isFullQuality ? 1 : active.renderer.qualityController.quality;
    this.#scheduler.frameStarted();
    try {
      const startMs = this.ports.now();
      const { renderer } = active;
      let frame = renderer.render(light, output, quality, {
        onlyInView: !isFullQuality,
        hasOverview: this.hasOverview,
      });
      if (!isFullQuality) this.#measure(active, startMs, frame);
      if (frame instanceof Promise) {
        active.frame = new Deferred();
        frame = await frame;
      }
      if (active.photo.value.isComplete) this.#refetches = 0;
      // Only pictures with finer parts may be drawn in part.
      const isReduced = quality < 1 || (!isFullQuality && renderer.snapshot !== undefined);
      if (active === this.#selector.active) this.#report(active, frame, light, quality, isReduced);
      return active.renderer;
    } catch (thrown) {
      if (active.isFreed || active !== this.#selector.active) {
        // The backend was replaced during the frame; its successor draws.
        if (signal.aborted) throw notLoaded(thrown);
        this.#isFullQualityRequested ||= isFullQuality;
        return this.#renderNext();
      }
      const error = toPhotoError(thrown);
      this.#handleFrameError(active, error);
      throw error;
    } finally {
      // Last, so that whoever waits for it finds the frame's effects.
      active.frame?.resolve();
      active.frame = null;
    }
  }

  /** Measures a frame of an animation for the choice of the next one's quality. */
  #measure(active: ActiveBackend, startMs: number, frame: ReturnType<Renderer['render']>): void {
    const { qualityController } = active.renderer;
    const record = () => qualityController.recordFrame(startMs, this.ports.now());
    if (frame instanceof Promise) frame.then(record, () => {});
    // A graphics device still works on the frame, which delays the browser's next one.
    else this.ports.nextFrame(record);
    // The page's own callback in the next frame may change the settings before the session's.
    this.#scheduler.requestFrame();
  }

  #report(
    active: ActiveBackend,
    frame: AppliedLightStatus,
    light: LightSetting,
    frameQuality: number,
    isReduced: boolean,
  ): void {
    const quality = frameQuality * active.photo.value.completeness;
    const isChanged = quality !== this.#quality;
    this.#quality = quality;
    this.#scheduler.frameDrawn(isReduced);
    if (!active.hasDrawn) {
      active.hasDrawn = true;
      this.#resting = null;
      this.listener.rendererChanged(active.renderer);
      this.#selector.freeOutgoing();
    }
    // An error of an image that has been replaced during the frame is obsolete.
    const isObsolete = light.image !== this.settings?.light.image;
    this.listener.frameDrawn(isObsolete ? { ...frame, lightError: null } : frame, light);
    if (isChanged) this.listener.qualityChanged(quality);
  }

  #handleFrameError(active: ActiveBackend, error: PhotoError): void {
    if (error.code === 'backend-lost') this.#selector.lose(active, error.message);
    else if (error.code !== 'photo-lost') this.#fail(error, active.hasDrawn);
    else if (active.photo.value.isComplete) this.#refetch(error.message);
    // The photograph replaces a lost preview.
    else this.#selector.drop();
  }

  #recover(): void {
    if (this.#failure === 'permanent') return;
    if (this.#failure) this.listener.recovered();
    this.#failure = null;
    if (!this.isLoaded && this.#photo?.value.isComplete) {
      this.isLoaded = true;
      this.listener.loaded();
    }
    // The photograph may be released now.
    if (!this.#isVisible) this.ports.library.update();
  }

  #fail(error: PhotoError, hasPicture = false): void {
    this.#failure ??= 'temporary';
    if (hasPicture || this.#isBehindPicture) this.listener.warned(error);
    else this.listener.failed(error);
  }

  #abortLoad(): void {
    this.#load.abort();
    this.#load = new AbortController();
  }

  #release(keepsPicture: boolean): void {
    this.#abortLoad();
    this.#resting = null;
    this.#selector.release();
    this.#scheduler.reset(keepsPicture);
    this.#photo?.release();
    this.#photo = null;
    this.#nextFrame = null;
    this.#quality = 1;
    this.#isFullQualityRequested = false;
    this.isLoaded = false;
    this.#failure = null;
  }
}

function notLoaded(cause?: unknown): PhotoError {
  const message = 'The photograph is not loaded yet: wait for its load event.';
  return new PhotoError('not-loaded', message, cause);
}
