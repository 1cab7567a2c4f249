/**
 * Connects the parts of an element. Attributes and input change the viewer's state; one `update` for all changes of a
 * script then brings the session, the shadow DOM, the animations and the page's listeners up to date with it.
 */

import { fetchStrings, isPending, observeTranslations } from '../i18n/translations.js';
import type { InteractionController } from '../input/interaction.js';
import { reducedMotion } from '../input/reduced-motion.js';
import type { TransitionOptions } from '../input/transitions.js';
import type { LayerChangeEvent } from '../levels/shard-layer.js';
import type { AppliedLightStatus } from '../lights/light-cache.js';
import type { LightSetting } from '../lights/light-setting.js';
import type { PhotographSource } from '../photo/types.js';
import { BROWSER_PORTS } from '../player/browser-ports.js';
import { PhotoSession } from '../player/photo-session.js';
import type { SessionSettings } from '../player/types.js';
import type { Renderer } from '../renderers/types.js';
import { explainOffline, missingScript, PhotoError } from '../shared/errors.js';
import { BACKENDS } from '../shared/keywords.js';
import { reuse } from '../shared/reuse-if-equal.js';
import { CENTRE, type PicturePoint } from '../shared/value-types.js';
import { type ActiveLight, ActiveLightTracker } from '../state/active-light-tracker.js';
import { AttributeReader } from '../state/attribute-reader.js';
import { type ElementOptions, readOptions } from '../state/options.js';
import { checkFields, type LightValue } from '../state/page-light.js';
import { ViewerState } from '../state/viewer-state.js';
import {
  clampView,
  type PictureRect,
  type ViewChange,
  viewOf,
  type ZoomView,
} from '../state/viewport.js';
import { ShadowDom } from '../ui/shadow-dom.js';
import { ViewerUi } from '../ui/viewer-ui.js';
import { EarlyInput } from './early-input.js';
import {
  BackendChangeEvent,
  ContextLostEvent,
  LightChangeEvent,
  PhotoErrorEvent,
  PhotoWarningEvent,
  QualityChangeEvent,
  ViewChangeEvent,
} from './events.js';
import { LoadStatus } from './load-status.js';
import { observeStyle } from './style-observer.js';
import { observeVisibility, placementOf, type VisibilityFlag } from './visibility.js';

export class ElementController<Host extends HTMLElement = HTMLElement> {
  readonly status: LoadStatus<Host>;
  readonly state: ViewerState;
  readonly session: PhotoSession;
  /** Takes the place of `src`. */
  photograph: PhotographSource | null = null;
  /** `null` until its script arrives, which is requested with the photograph. */
  #interaction: InteractionController | null = null;
  #inputFetch: Promise<void> | null = null;
  readonly #earlyInput: EarlyInput;
  /** The visitor pressed the poster before that. */
  #isMarkedActive = false;
  readonly #reader: AttributeReader;
  readonly #dom: ShadowDom;
  readonly #viewerUi: ViewerUi;
  readonly #lightChanges = new ActiveLightTracker();
  #reportedView: ZoomView;
  #mustReload = false;
  #isUpdateScheduled = false;
  /** Ends the listeners that exist only while the element is in the document. */
  #connection: AbortController | null = null;
  /** Why the last frame was not drawn with the requested light. */
  #lightError: PhotoError | null = null;

  constructor(private readonly host: Host) {
    this.status = new LoadStatus(host);
    this.#reader = new AttributeReader(host);
    this.#dom = new ShadowDom(host);
    this.state = new ViewerState(readOptions(this.#reader, null), {
      changed: () => this.session.redraw(),
      loaded: () => this.schedule(),
      errorChanged: (error) => this.#warnOfLight(error),
    });
    this.#reportedView = this.state.view;
    this.#viewerUi = this.#createViewerUi();
    this.session = this.#createSession();
    this.#earlyInput = new EarlyInput(this.#dom.root, () => this.state.isPictureShown);
    this.#dom.revealButton.addEventListener('click', () => {
      this.#markActive();
      this.dismissPoster();
    });
    this.#dom.retryButton.addEventListener('click', () => this.load());
    this.#dom.content.addEventListener('change', (event) => {
      const { detail } = event as LayerChangeEvent;
      if (detail) this.warn(detail);
      else this.session.redraw();
    });
    host.addEventListener('fullscreenchange', () => this.schedule());
  }

  /** Updates once the current script has ended. */
  schedule(): void {
    if (this.#isUpdateScheduled) return;
    this.#isUpdateScheduled = true;
    queueMicrotask(() => {
      if (this.#isUpdateScheduled) this.update();
    });
  }

  update(): void {
    this.#isUpdateScheduled = false;
    if (!this.host.isConnected) {
      this.#release();
      return;
    }
    this.#connect();
    const options = this.readOptions();
    const { state, isPaused } = this;
    const { language } = this.#viewerUi;
    state.light.observe(state.reveal.isVisible, !isPaused);
    if (isPending(language)) void fetchStrings(language).then(() => this.schedule());
    this.#viewerUi.update(isPaused, this.#interaction?.isTilting ?? null);
    this.#showError();
    this.#interaction?.update(!isPaused);
    const addressError = this.#reader.errorOf('src');
    for (const error of this.#reader.takeErrors()) {
      // Without an earlier address there is no picture, which is an error.
      if (options.src !== null || error !== addressError) this.warn(error);
    }
    this.#updateSession(options);
    this.#reportLight(this.#lightChanges.requested(state.light.setting));
    if (state.view !== this.#reportedView) {
      this.#reportedView = state.view;
      this.#dispatch(new ViewChangeEvent(state.view));
    }
  }

  /** Reads attributes that may have changed in the current script. */
  readOptions(): ElementOptions {
    const { state } = this;
    const { width = 0, height = 0 } = this.session.photo?.info ?? {};
    state.options = readOptions(this.#reader, state.options, Math.max(width, height));
    return state.options;
  }

  attributeChanged(name: string): void {
    // As on <img>, setting the same address again reloads the file.
    if (name === 'src') this.setPhotograph(null);
    if (/^light(?!-color)/.test(name)) this.#interaction?.stopTorch();
    this.state.clearOverride(name);
    this.schedule();
  }

  setPhotograph(source: PhotographSource | null): void {
    this.photograph = source;
    this.load();
  }

  /** Loads the photograph again. An invalid address keeps the last photograph. */
  load(): void {
    this.#reader.readAddress('src');
    if (!this.#addressError || !this.session.settings) {
      this.#mustReload = true;
      this.status.set(null);
    }
    this.schedule();
  }

  get pictureBox(): DOMRectReadOnly | null {
    return this.#dom.pictureBox;
  }

  get isPaused(): boolean {
    return this.state.paused ?? reducedMotion().matches;
  }
  set isPaused(isPaused: boolean) {
    this.state.paused = isPaused;
    this.schedule();
  }

  setLight(light: LightValue): void {
    this.readOptions();
    this.state.pageLight = light;
    this.#interaction?.stopTorch();
    this.#lightError = null;
    this.schedule();
  }

  /** @throws {TypeError} for an invalid field */
  setTorch(torch: Partial<PicturePoint> | null): void {
    if (torch !== null) checkFields(torch, 'torch', ['x', 'y']);
    const last = this.state.light.torch ?? CENTRE;
    this.#interaction?.stopTorch();
    this.state.light.torch = torch && { x: torch.x ?? last.x, y: torch.y ?? last.y };
    this.schedule();
  }

  async lightTo(light: LightValue, options: TransitionOptions): Promise<void> {
    // Otherwise at once, so that later changes take precedence.
    if (!this.#interaction) await this.#fetchInput();
    if (this.#interaction) await this.#interaction.lightTo(() => this.setLight(light), options);
    else this.setLight(light);
  }

  async viewTo(view: ViewChange | PictureRect, options: TransitionOptions): Promise<void> {
    const target = this.#completeView(view);
    if (!this.#interaction) await this.#fetchInput();
    if (this.#interaction) await this.#interaction.viewTo(target, options);
    else this.setView(target);
  }

  setView(view: ViewChange): void {
    const target = this.#completeView(view);
    this.#interaction?.stopView();
    this.state.view = target;
    this.schedule();
  }

  /** The current view with other values. @throws {TypeError} for an invalid field */
  #completeView(wanted: ViewChange | PictureRect): ZoomView {
    checkFields(wanted, 'view', ['zoom', 'x', 'y', 'width', 'height', 'scale']);
    const view: ViewChange = 'width' in wanted ? viewOf(wanted) : wanted;
    const { maxZoom } = this.readOptions();
    const last = this.state.view;
    const { scale, zoom = scale === undefined ? last.zoom : scale * this.#dom.actualSizeZoom } =
      view;
    if (zoom > 1 && maxZoom === 1) {
      const message = `A view with zoom ${zoom} shows the whole picture: set the zoom attribute.`;
      this.warn(new PhotoError('attribute', message));
    }
    return clampView({ zoom, x: view.x ?? last.x, y: view.y ?? last.y }, maxZoom);
  }

  dismissPoster(): void {
    this.state.reveal.isDismissed = true;
    this.schedule();
  }

  reset(): void {
    this.#interaction?.reset();
    this.#isMarkedActive = false;
    this.state.reset();
    this.schedule();
  }

  /** Browsers ask the visitor only directly after a press, so the script should have arrived by then. */
  async requestTilt(): Promise<boolean> {
    if (!this.#interaction) await this.#fetchInput();
    return (await this.#interaction?.requestTilt()) ?? false;
  }

  /** Draws the current state in full quality, after the fetch of the support for its light source. */
  async renderNow(): Promise<Renderer> {
    this.update();
    const pending = this.state.light.pendingSource;
    if (pending) {
      await pending;
      this.update();
    }
    return this.session.renderNow();
  }

  /** Reports a fault that leaves the picture as it is: to developers, not to visitors. */
  warn(error: PhotoError): void {
    console.warn(`<relightable-photo> ${error.code}: ${error.message}`);
    this.#dispatch(new PhotoWarningEvent(error));
  }

  #markActive(): void {
    this.#isMarkedActive = true;
    this.#interaction?.markActive();
  }

  /** The script for gestures, keys and animations is requested after the photograph, which it must not delay. */
  #fetchInput(): Promise<void> {
    this.#inputFetch ??= import('../input/interaction.js').then(
      ({ InteractionController }) => {
        this.#interaction = new InteractionController(this.state, this.#dom, this.#viewerUi, {
          changed: () => this.schedule(),
          expired: () => this.reset(),
          overviewChanged: (isShown) => {
            this.session.hasOverview = isShown;
            this.session.redraw();
          },
          failed: (error) => this.warn(error),
        });
        if (this.#isMarkedActive) this.#interaction.markActive();
        this.#earlyInput.replay();
        this.schedule();
      },
      (cause: unknown) => {
        // Nothing receives the events, and no more are kept.
        this.#earlyInput.replay();
        this.warn(missingScript('input-unavailable', 'gestures, keys and animations', cause));
      },
    );
    return this.#inputFetch;
  }

  #createViewerUi(): ViewerUi {
    return new ViewerUi(this.host, this.#dom, this.state, {
      selectLight: (item) => {
        this.#interaction?.stopTorch();
        this.state.light.item = item;
        this.#markActive();
        this.schedule();
      },
      play: () => {
        this.isPaused = !this.isPaused;
      },
      zoom: (by) => this.#interaction?.zoom(by),
      reset: () => this.reset(),
      tilt: () => this.#interaction?.toggleTilt(),
      loaded: () => this.schedule(),
      failed: (error) => this.warn(error),
    });
  }

  #createSession(): PhotoSession {
    const { host } = this;
    return new PhotoSession(BROWSER_PORTS, {
      get placement() {
        return placementOf(host);
      },
      loadStarted: () => {
        this.status.set('loading');
        this.#clearPicture();
        this.schedule();
        this.#dom.updateProgress(Number.NaN);
      },
      progress: (loaded, total) => {
        this.#dom.updateProgress(total > 0 ? Math.min(1, loaded / total) : Number.NaN);
        this.#fetchInput();
        const progress = { loaded, total, lengthComputable: total > 0 };
        this.#dispatch(new ProgressEvent('progress', progress));
      },
      frameDrawn: (frame, light) => this.#frameDrawn(frame, light),
      qualityChanged: (quality) => this.#dispatch(new QualityChangeEvent(quality)),
      loaded: () => {
        this.#dom.updateProgress(null);
        this.#viewerUi.announce('loaded');
        this.status.set('ready');
        this.#dispatch(new Event('load'));
      },
      rendererChanged: ({ canvas, layer }) => {
        this.#dom.showCanvas(canvas, layer, this.session.photo?.info ?? canvas);
        this.schedule();
      },
      backendChanged: (backend, previous, reason) =>
        this.#dispatch(new BackendChangeEvent(backend, previous, reason)),
      backendLost: (backend, message) => {
        this.#dispatch(new ContextLostEvent(backend, message));
        this.warn(new PhotoError('backend-lost', `${backend} was lost: ${message}`));
      },
      failed: (error) => this.#fail(error),
      warned: (error) => {
        this.#dom.updateProgress(null);
        this.warn(error);
      },
      recovered: () => {
        this.state.errorMessage = null;
        this.status.set(this.session.isLoaded ? 'ready' : 'loading');
        this.schedule();
      },
    });
  }

  /** There is no picture. */
  #fail(cause: PhotoError): void {
    const error = explainOffline(cause);
    this.state.errorMessage = error.message;
    this.status.set('error', error);
    this.#dom.updateProgress(null);
    this.schedule();
    this.#showError();
    this.#dispatch(new PhotoErrorEvent(error));
  }

  #frameDrawn({ lightApplied, lightError }: AppliedLightStatus, drawn: LightSetting): void {
    const { reveal, light } = this.state;
    this.#fetchInput();
    if (!reveal.isDrawn) this.schedule();
    reveal.isDrawn = true;
    this.#interaction?.frameDrawn();
    const { setting, activeSource } = light;
    if (lightApplied && activeSource && drawn.image === setting.image) {
      this.#reportLight(this.#lightChanges.drawn(setting.name, activeSource));
    }
    // An error that persists is reported once, even if its numbers change with each frame.
    if (lightError?.code === this.#lightError?.code) return;
    this.#lightError = lightError;
    this.#warnOfLight(lightError);
  }

  /** The photograph continues to load and to be drawn. */
  #warnOfLight(error: PhotoError | null): void {
    if (error && this.host.isConnected) this.warn(error);
  }

  #connect(): void {
    if (this.#connection) return;
    this.#connection = new AbortController();
    const { signal } = this.#connection;
    reducedMotion().addEventListener('change', () => this.schedule(), { signal });
    observeTranslations(() => this.schedule(), signal);
    const retry = () => {
      if (/^(offline|http-network)$/.test(this.status.error?.code ?? '')) this.load();
    };
    addEventListener('online', retry, { signal });
    const update = (visibility: VisibilityFlag, isTrue: boolean) => {
      this.state.reveal[visibility] = isTrue;
      if (visibility === 'isVisible') this.session.setVisible(isTrue);
      else this.session.setNear(isTrue);
      this.schedule();
    };
    observeVisibility(this.host, update, signal);
    const follow = () => {
      this.#dom.updateFit();
      this.schedule();
    };
    observeStyle(this.host, follow, signal);
  }

  /** Gives the session new settings, as soon as the photograph may be fetched. */
  #updateSession(options: ElementOptions): void {
    const src = this.photograph ?? options.src;
    const last = this.session.settings;
    const addressError = this.#addressError;
    if (src === null && addressError) {
      if (this.#mustReload) this.#fail(addressError);
      this.#mustReload = false;
      return;
    }
    const reload = this.#mustReload && !addressError;
    if (reload || src !== last?.src) {
      if (src !== null && !this.state.reveal.mayFetch(options)) {
        if (last && last.src !== src) this.#stopSession();
        return;
      }
      this.#mustReload = false;
    }
    const settings = reuse<SessionSettings>(last, {
      src,
      credentials: options.crossOrigin === 'use-credentials' ? 'include' : 'same-origin',
      backendOptions: reuse(last?.backendOptions, {
        backends: options.backends ?? BACKENDS,
        // Software renderers are used only on request: the CPU backend is faster.
        software: options.backends !== null,
        gamut: options.gamut,
      }),
      output: this.state.output,
      light: this.state.light.setting,
    });
    if (settings !== last || reload) this.session.set(settings, reload);
  }

  /** Why `src` is invalid, if it is needed. */
  get #addressError(): PhotoError | null {
    return this.photograph ? null : this.#reader.errorOf('src');
  }

  #reportLight(light: ActiveLight | null): void {
    if (light) this.#dispatch(new LightChangeEvent(light.name, light.torch, light.source));
  }

  #showError(): void {
    this.#viewerUi.showError(this.state.errorMessage, this.status.error?.code === 'offline');
  }

  #clearPicture(): void {
    this.state.reveal.isDrawn = false;
    this.state.errorMessage = null;
    this.#lightError = null;
    this.#dom.clear();
    this.#showError();
  }

  #stopSession(): void {
    this.session.stop();
    this.#clearPicture();
  }

  /** The element has left the document. */
  #release(): void {
    this.#connection?.abort();
    this.#connection = null;
    this.state.reveal.isNear = false;
    this.state.reveal.isVisible = false;
    this.#interaction?.stop();
    this.state.light.observe(false, false);
    this.#reader.clear();
    this.status.set(null);
    this.#stopSession();
  }

  #dispatch(event: Event): void {
    this.host.dispatchEvent(event);
  }
}
