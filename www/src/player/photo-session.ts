/**
 * One photograph on the page: it is loaded, given a backend, drawn and released. Ports stand for the browser.
 *
 *     set ─▶ load ─▶ preview or photograph ─▶ BackendSelector ─▶ renderer ─▶ frames (FrameScheduler)
 *             ▲                                   │ photo-lost
 *             └───────────────────────────────────┘
 *
 * Each load has a signal, which is aborted when another load starts or the session stops. Whatever continues after a
 * wait checks it, and frees its result if it has come too late.
 */

import type { Backend } from '../engine/wasm-exports.js';
import type { AppliedLightStatus } from '../lights/light-cache.js';
import type { LightSetting } from '../lights/light-setting.js';
import type { LoadedPhotograph } from '../photo/photograph.js';
import type { Renderer } from '../renderers/types.js';
import { PhotoError, toPhotoError } from '../shared/errors.js';
import { Deferred } from '../shared/promises.js';
import { type ActiveBackend, RefCounted } from './active-backend.js';
import { BackendSelector } from './backend-selector.js';
import { FrameScheduler } from './frame-scheduler.js';
import type { PhotoSessionListener, SessionPorts, SessionSettings } from './types.js';

/** How often a photograph that loses tiles is fetched again without a frame in between. */
const MAX_REFETCHES = 5;

export class PhotoSession {
  readonly #selector: BackendSelector;
  readonly #scheduler: FrameScheduler;
  /** `null` while it is stopped. */
  settings: SessionSettings | null = null;
  /** Whether a frame of the whole photograph was drawn; previews are drawn before. */
  isLoaded = false;
  /** A failed load is permanent: frames, which are of a preview then, do not repair it. */
  #failure: 'temporary' | 'permanent' | null = null;
  /** Aborted when the load and its photograph are released. */
  #load = new AbortController();
  #photo: RefCounted<LoadedPhotograph> | null = null;
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
  get photo(): LoadedPhotograph | null {
    return this.#photo?.value ?? null;
  }

  get backend(): Backend | null {
    return this.#selector.active?.backend ?? null;
  }

  get renderer(): Renderer | null {
    return this.#selector.active?.renderer ?? null;
  }

  /** The share of the photograph's components in the last frame; `null` before the first. */
  get quality(): number | null {
    return this.#selector.active?.hasDrawn ? this.#quality : null;
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
      void this.#run(settings, null, '');
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
    this.#scheduler.setVisible(isVisible);
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
  renderNow(): Promise<Renderer> {
    this.#isFullQualityRequested = true;
    return this.#renderNext();
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
      this.#fail(error, this.#scheduler.hasPicture);
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
  ): Promise<void> {
    const { signal } = this.#load;
    const preparation = new AbortController();
    const onPreview = (preview: LoadedPhotograph): void => {
      // The last preview must be drawn first.
      if (signal.aborted || this.#selector.search) preview.free();
      else void this.#use(preview, previous, reason);
    };
    try {
      if (src === null) {
        const message = 'There is no photograph to show: set the src attribute.';
        throw new PhotoError('src-missing', message);
      }
      this.ports.prepare(backendOptions, preparation.signal);
      const photo = await this.ports.open(src, credentials, {
        signal,
        onProgress: (loaded, total) => {
          if (!signal.aborted) this.listener.progress(loaded, total);
        },
        // After a loss, the picture on the screen is finer than a preview.
        onPreview: this.#scheduler.hasPicture ? null : onPreview,
      });
      // The backend that the preview's search finds is used for the photograph as well.
      while (this.#selector.search && !signal.aborted) await this.#selector.search;
      if (signal.aborted) photo.free();
      else await this.#use(photo, previous, reason);
    } catch (thrown) {
      if (signal.aborted) return;
      this.#failure = 'permanent';
      this.#fail(toPhotoError(thrown), this.#refetches > 0 && this.#scheduler.hasPicture);
    } finally {
      preparation.abort();
    }
  }

  async #use(photo: LoadedPhotograph, previous: Backend | null, reason: string): Promise<void> {
    const { backend } = this;
    this.#photo?.release();
    const shared = new RefCounted(photo);
    this.#photo = shared;
    // The canvas of the CPU keeps its picture by itself, and memory may suffice for one photograph only.
    if (backend === 'cpu') this.#selector.active?.free();
    const options = this.settings?.backendOptions;
    if (!options) return;
    if (!backend) return this.#selector.select(shared, options, previous, reason);
    // Backends that could not draw the preview are not tried again.
    const backends = options.backends.slice(options.backends.indexOf(backend));
    return this.#selector.select(shared, { ...options, backends }, backend, '');
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
    const quality = isFullQuality ? 1 : active.qualityController.quality;
    this.#scheduler.frameStarted();
    try {
      const startMs = this.ports.now();
      let frame = active.renderer.render(light, output, quality);
      if (!isFullQuality) this.#measure(active, startMs, frame);
      if (frame instanceof Promise) {
        active.frame = new Deferred();
        frame = await frame;
      }
      if (active.photo.value.isComplete) this.#refetches = 0;
      if (active === this.#selector.active) this.#report(active, frame, light, quality);
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
    const record = () => active.qualityController.recordFrame(startMs, this.ports.now());
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
  ): void {
    const quality = frameQuality * active.photo.value.completeness;
    const isChanged = quality !== this.#quality;
    this.#quality = quality;
    this.#scheduler.frameDrawn(frameQuality < 1);
    if (!active.hasDrawn) {
      active.hasDrawn = true;
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
    if (!this.isLoaded && this.photo?.isComplete) {
      this.isLoaded = true;
      this.listener.loaded();
    }
  }

  #fail(error: PhotoError, hasPicture = false): void {
    this.#failure ??= 'temporary';
    if (hasPicture) this.listener.warned(error);
    else this.listener.failed(error);
  }

  #release(keepsPicture: boolean): void {
    this.#load.abort();
    this.#load = new AbortController();
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
