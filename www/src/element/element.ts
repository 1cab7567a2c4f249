/** `<relightable-photo>`: attributes and visitors in, events and a picture out. */

import type { Backend, Gamut } from '../engine/types.js';
import { setModuleFolder } from '../engine/wasm-loader.js';
import { fetchTranslations, isMissing } from '../i18n/strings.js';
import { Visitor } from '../input/interaction.js';
import type { ImageLight } from '../lights/image-light.js';
import { parseCssColor } from '../lights/light-color.js';
import { checkLightSource, isLightSource, type LightSource } from '../lights/light-source.js';
import type { PhotoInfo } from '../photo/photograph.js';
import { PhotoSession } from '../player/photo-session.js';
import { BROWSER_PORTS } from '../player/ports.js';
import { encodeCanvas, resampleCanvas } from '../renderers/canvas-export.js';
import type { CanvasRenderer } from '../renderers/types.js';
import type { PhotoError } from '../shared/errors.js';
import { BACKENDS, type LightName } from '../shared/names.js';
import type { PicturePoint } from '../shared/values.js';
import { Attributes } from '../state/attribute-reader.js';
import { LightNews, type Shining } from '../state/light-change.js';
import type { Lighting } from '../state/lighting.js';
import { type Asked, readAsked } from '../state/options.js';
import { Exhibit, type LightPose } from '../state/viewer-state.js';
import { type PhotoView, WHOLE } from '../state/viewport.js';
import { Controls } from '../ui/controls.js';
import { isFullscreen, toggleFullscreen } from '../ui/fullscreen.js';
import { Presenter } from '../ui/presenter.js';
import { View } from '../ui/view.js';
import {
  BackendChangeEvent,
  ContextLostEvent,
  LightChangeEvent,
  loadEvent,
  PhotoErrorEvent,
  progressEvent,
  QualityChangeEvent,
  type RelightablePhotoEventMap,
  ViewChangeEvent,
} from './events.js';
import { ATTRIBUTES, PROPERTIES, type Reflected, reflect } from './reflect.js';
import { unwatch, watch } from './visibility.js';

// On a server there are no elements, but importing this module must not fail there.
const Base = globalThis.HTMLElement ?? (class {} as unknown as typeof HTMLElement);

export type { PhotoInfo };

/** Options of `toBlob`. */
export interface BlobOptions {
  /** MIME type; a PNG, which is exact, unless another is asked for. */
  readonly type?: string;
  /** 0 to 1, for types that lose some. */
  readonly quality?: number;
  /** Factor on the picture's pixels along either side, up to 4. */
  readonly scale?: number;
}

const MAX_SCALE = 4;

/**
 * A photograph that can be relit.
 *
 * @fires {Event} load - The whole photograph is there and drawn.
 * @fires {ProgressEvent} progress - More of the file has come: `loaded` bytes of `total`, which is 0 until known.
 * @fires {PhotoErrorEvent} error - Something failed: `code` for programs, `message` for people, `cause`.
 * @fires {LightChangeEvent} lightchange - The light is another, or the torch has moved: `light`, `torch`, `source`.
 * @fires {ViewChangeEvent} viewchange - Another part of the picture is shown: `zoom`, `x`, `y`.
 * @fires {BackendChangeEvent} backendchange - A back end was taken up: `backend`, `previous`, `reason`.
 * @fires {ContextLostEvent} contextlost - The back end in use is gone: `backend`, `message`.
 * @fires {QualityChangeEvent} qualitychange - The picture is drawn by another `share` of the photograph.
 *
 * @slot - What browsers show that run no script.
 * @slot poster - Shown until the photograph is drawn, in the place of `poster`.
 * @slot progress - Shown while the file comes, in the place of the bar.
 * @slot controls - Shown in the place of the toolbar.
 * @slot error - Shown where the photograph cannot be, in the place of the message.
 *
 * @csspart picture - The picture with all that lies over it.
 * @csspart canvas - The canvas that the photograph is drawn on.
 * @csspart poster - What is shown until the photograph is drawn.
 * @csspart progress - The bar that tells how much of the file has come.
 * @csspart message - What went wrong, in words.
 * @csspart controls - The toolbar.
 * @csspart menu - Its list of lights.
 * @csspart button - Each button.
 * @csspart torch-handle - What has the keyboard's focus while the torch is moved.
 * @csspart hint - How to zoom where gestures are the page's.
 * @csspart status - What is read out to those who cannot see it.
 *
 * @cssprop --relightable-photo-background - Behind the picture, and where there is none.
 * @cssprop --relightable-photo-color - Text on that.
 * @cssprop --relightable-photo-accent - The bar of progress.
 * @cssprop --relightable-photo-focus - The ring around what has the keyboard's focus.
 * @cssprop --relightable-photo-aspect - Width / height of the space that is kept until the photograph is there.
 */
// biome-ignore lint/suspicious/noUnsafeDeclarationMerging: the interface adds the properties that are attributes, and overloads of methods that Base has
export class RelightablePhoto extends Base {
  static readonly observedAttributes: readonly string[] = [...ATTRIBUTES, 'lang'];

  static {
    reflect(RelightablePhoto.prototype);
  }

  readonly #view: View;
  readonly #controls: Controls;
  readonly #visitor: Visitor;
  readonly #session: PhotoSession<CanvasRenderer>;
  readonly #attributes = new Attributes();
  readonly #exhibit: Exhibit;
  readonly #presenter: Presenter;
  readonly #news = new LightNews();
  #toldView = WHOLE;
  /** The address that was given to the player. */
  #fetched: string | null | undefined;
  /** What the player was told last to draw, in words, and the picture that it is lit by. */
  #drawn: string | null = null;
  #drawnBy: ImageLight | null = null;
  #reload = false;
  #scheduled = false;
  #listening: AbortController | null = null;
  #lightFault: PhotoError | null = null;

  constructor() {
    super();
    const root = this.attachShadow({ mode: 'open' });
    this.#view = new View(root);
    this.#exhibit = new Exhibit(
      this.#read(),
      {
        changed: () => this.#session.redraw(),
        came: () => this.#schedule(),
        errorChanged: (fault) => this.#lightFaultChanged(fault),
      },
      parseCssColor,
    );
    this.#controls = new Controls(
      this.#view,
      {
        choose: (item) => {
          this.#lighting.item = item;
          this.#visitor.touch();
          this.#schedule();
        },
        play: () => {
          this.paused = !this.paused;
        },
        zoom: (by) => this.#visitor.zoom(by),
        reset: () => this.reset(),
        tilt: () => {
          if (!this.#visitor.tilts) void this.requestTilt();
          else this.#visitor.reset();
          this.#schedule();
        },
        fullscreen: () => toggleFullscreen(this),
      },
      () => this.#schedule(),
      (error) => this.dispatchEvent(new PhotoErrorEvent(error)),
    );
    this.#presenter = new Presenter(this, this.#view, this.#controls, this.#exhibit);
    this.#session = this.#newSession();
    this.#visitor = this.#newVisitor(root);
    this.#view.revealButton.addEventListener('click', () => {
      this.#visitor.touch();
      this.dismissPoster();
    });
    this.addEventListener('fullscreenchange', () => this.#schedule());
  }

  /** Colours that the canvas shows: those asked for where the browser can; `null` without a picture. */
  get activeGamut(): Gamut | null {
    return this.#session.renderer?.gamut ?? null;
  }

  /** The built-in light that shines, or that a source stands in for: a visitor may have chosen it. */
  get activeLight(): LightName {
    return this.#lighting.name;
  }

  /** Where the torch shines, on the picture; `null`: over the middle of the light. */
  get torch(): PicturePoint | null {
    return this.#lighting.torch;
  }
  set torch(point: PicturePoint | null) {
    if (point && !(Number.isFinite(point.x) && Number.isFinite(point.y))) {
      throw new TypeError('torch must be null or have finite numbers x and y, from 0 to 1');
    }
    this.#lighting.torch = point;
    this.#schedule();
  }

  /** The part of the picture that is shown: its middle, and a magnification of no more than `zoom`. */
  get view(): PhotoView {
    return this.#exhibit.view;
  }
  set view(view: PhotoView) {
    if (![view?.zoom, view?.x, view?.y].every(Number.isFinite)) {
      throw new TypeError('view must have finite numbers zoom, from 1, and x and y, from 0 to 1');
    }
    this.#exhibit.asked = this.#read();
    this.#exhibit.view = view;
    this.#schedule();
  }

  /** Whether what moves by itself stands still: fire, the film of `light-src`, the wandering torch. */
  get paused(): boolean {
    return this.#exhibit.paused ?? motion().matches;
  }
  set paused(paused: boolean) {
    this.#exhibit.paused = paused;
    this.#schedule();
  }

  /**
   * What shines in place of the built-in light, by a script; `null`, to begin with, where none does. The built-in
   * light or the last one stays until there is something to be seen, and where something is wrong with
   * the source. Frames of videos and streams are followed while the element is in view. A canvas that is
   * drawn on by WebGL has to have `preserveDrawingBuffer`, as it is looked at after its own frame.
   */
  get lightSource(): LightSource | null {
    return this.#lighting.source;
  }
  set lightSource(value: LightSource | null) {
    const source = value === null ? null : checkLightSource(value);
    if (source !== null && source === this.#lighting.shining) {
      this.lightChanged();
      return;
    }
    this.#lighting.source = source;
    this.#lightFault = null;
    this.#schedule();
  }

  /**
   * Looks at the `lightSource` again, in the next frame: canvases, `ImageData` and numbers change without
   * telling.
   */
  lightChanged(): void {
    if (this.#lighting.shining) this.#session.redraw();
  }

  /**
   * Has a light shine until `reset`, or until an attribute asks for another: a built-in one by its name, with
   * its place, size and colour if need be, or a source, as by `lightSource`. `null`: the page's own, without a source.
   */
  setLight(light: LightName | LightPose | LightSource | null): void {
    if (light === null || isLightSource(light)) {
      this.#lighting.reset();
      this.lightSource = light;
    } else {
      this.#exhibit.pose(typeof light === 'string' ? { name: light } : light);
    }
    this.#schedule();
  }

  /** Light and view as the attributes and `lightSource` say. */
  reset(): void {
    this.#visitor.reset();
    this.#exhibit.reset();
    this.#schedule();
  }

  /** Light and view in a few letters, all of which addresses may hold. What a source shows is not among it. */
  getState(): string {
    this.#exhibit.asked = this.#read();
    return this.#exhibit.state;
  }

  /** Takes what `getState` gave, here or at another element. What it does not tell is as the page asks. */
  setState(text: string): void {
    this.reset();
    this.#exhibit.asked = this.#read();
    const faults = this.#exhibit.take(text);
    for (const fault of faults) this.dispatchEvent(new PhotoErrorEvent(fault));
  }

  /** Has the poster give way, as soon as there is a picture. */
  dismissPoster(): void {
    this.#exhibit.curtain.lifted = true;
    this.#schedule();
  }

  /**
   * Has the torch follow how the device is held. Gives whether it may; some browsers ask the visitor, who
   * must have pressed something just before. Ends with `reset`.
   */
  requestTilt(): Promise<boolean> {
    return this.#visitor.tilt();
  }

  /** The back end that draws, `null` while there is none. */
  get activeBackend(): Backend | null {
    return this.#session.backend;
  }

  /**
   * The share of the photograph that the picture is drawn by, the most important of it first: 1, or less
   * while it moves faster than all of it can be drawn. `null` while there is no picture.
   */
  get detail(): number | null {
    return this.#session.quality;
  }

  /** What the back end says of itself: the kernel, the adapter. */
  get kernel(): string | null {
    return this.#session.renderer?.kernel ?? null;
  }

  /** What is known of the photograph, `null` until it is decoded. */
  get info(): PhotoInfo | null {
    return this.#session.photo?.info ?? null;
  }

  /**
   * Draws the picture as it is set now, all of it in full detail, and encodes it. Rejects with `not-loaded`
   * while there is no photograph, and where another takes its place meanwhile.
   */
  async toBlob({ type = 'image/png', quality, scale = 1 }: BlobOptions = {}): Promise<Blob> {
    if (!(scale > 0 && scale <= MAX_SCALE)) {
      throw new RangeError(`scale must be more than 0 and at most ${MAX_SCALE}`);
    }
    this.#update();
    if (this.#lighting.coming) {
      await this.#lighting.coming;
      this.#update();
    }
    const renderer = await this.#session.renderNow();
    // The canvas of a GPU keeps its content only until the browser has shown it.
    const { canvas, gamut } = renderer;
    return encodeCanvas(scale === 1 ? canvas : resampleCanvas(canvas, scale, gamut), type, quality);
  }

  connectedCallback(): void {
    // Properties that were set before this class was known hide its setters.
    for (const name of [...PROPERTIES, 'torch', 'lightSource', 'view', 'paused'] as const) {
      if (Object.hasOwn(this, name)) {
        const value = this[name];
        delete (this as Record<string, unknown>)[name];
        Object.assign(this, { [name]: value });
      }
    }
    this.#schedule();
  }

  disconnectedCallback(): void {
    // Not at once: an element that only moves within the document is back before the update.
    this.#schedule();
  }

  attributeChangedCallback(name: string): void {
    // As with <img>, setting the same address again loads again.
    if (name === 'src') this.#reload = true;
    this.#exhibit.overrule(name);
    this.#schedule();
  }

  #newSession(): PhotoSession<CanvasRenderer> {
    return new PhotoSession(BROWSER_PORTS, {
      loadStarted: () => {
        this.#clear();
        this.#view.progress(Number.NaN);
      },
      progress: (loaded, total) => {
        this.#view.progress(total > 0 ? Math.min(1, loaded / total) : Number.NaN);
        this.dispatchEvent(progressEvent(loaded, total));
      },
      frameDrawn: ({ lightApplied, lightError: fault }, light) => {
        const { curtain } = this.#exhibit;
        if (!curtain.drawn) this.#schedule();
        curtain.drawn = true;
        const { setting, shining } = this.#lighting;
        if (lightApplied && shining && light.image === setting.image) {
          this.#tellLight(this.#news.drawn(setting.name, shining));
        }
        // A light that stays wrong says so once, not at every frame with other numbers.
        if (fault?.code === this.#lightFault?.code) return;
        this.#lightFault = fault;
        this.#lightFaultChanged(fault);
      },
      qualityChanged: (quality) => this.dispatchEvent(new QualityChangeEvent(quality)),
      loaded: () => {
        this.#view.progress(null);
        this.#presenter.tellLoaded();
        this.dispatchEvent(loadEvent());
      },
      rendererChanged: (renderer) => {
        this.#view.show(renderer.canvas);
        this.#schedule();
      },
      backendChanged: (backend, previous, reason) => {
        this.dispatchEvent(new BackendChangeEvent(backend, previous, reason));
      },
      backendLost: (backend, message) => this.dispatchEvent(new ContextLostEvent(backend, message)),
      failed: (error) => {
        this.#exhibit.fault = error.message;
        this.#view.progress(null);
        this.#schedule();
        this.#showFault();
        this.dispatchEvent(new PhotoErrorEvent(error));
      },
      recovered: () => {
        this.#exhibit.fault = null;
        this.#schedule();
      },
    });
  }

  #newVisitor(root: ShadowRoot): Visitor {
    return new Visitor(root, this.#view, this.#exhibit, {
      changed: () => this.#schedule(),
      looked: () => {
        this.#presenter.tellZoom();
        this.#schedule();
      },
      lightChosen: (item) => {
        this.#presenter.tellLight(item);
        this.#schedule();
      },
      leave: () => {
        if (isFullscreen(this)) toggleFullscreen(this);
        else (this.shadowRoot?.activeElement as HTMLElement | null)?.blur();
      },
      scrolled: (by) => this.#presenter.hint(by),
      expired: () => {
        this.reset();
        this.#controls.close();
        if (isFullscreen(this)) toggleFullscreen(this);
      },
      touched: (byKey) => this.#controls.wake(byKey),
    });
  }

  /** Changes come in bunches: they are looked at together, once the current script is done. */
  #schedule(): void {
    if (this.#scheduled) return;
    this.#scheduled = true;
    queueMicrotask(() => {
      if (this.#scheduled) this.#update();
    });
  }

  #update(): void {
    this.#scheduled = false;
    if (!this.isConnected) {
      this.#letGo();
      return;
    }
    if (!this.#listening) {
      this.#listening = new AbortController();
      const { signal } = this.#listening;
      motion().addEventListener('change', () => this.#schedule(), { signal });
    }
    watch(this, (sight, is) => {
      this.#exhibit.curtain[sight] = is;
      if (sight === 'seen') this.#session.setVisible(is);
      this.#schedule();
    });
    const asked = this.#read();
    this.#exhibit.asked = asked;
    this.#lighting.follow(this.#exhibit.curtain.seen, !this.paused);
    if (isMissing(this.#presenter.language)) void fetchTranslations().then(() => this.#schedule());
    this.#presenter.present(this.paused, this.#visitor.tilts);
    this.#showFault();
    this.#visitor.update(!this.paused);
    for (const fault of this.#attributes.takeFaults()) {
      this.dispatchEvent(new PhotoErrorEvent(fault));
    }
    this.#load(asked);
    this.#tellLight(this.#news.asked(this.#lighting.setting));
    const { view } = this.#exhibit;
    if (view !== this.#toldView) {
      this.#toldView = view;
      this.dispatchEvent(new ViewChangeEvent(view));
    }
  }

  #read(): Asked {
    return readAsked(this, this.#attributes, parseCssColor);
  }

  /** Has the player do what is asked for, as soon as the photograph may be fetched. */
  #load(asked: Asked): void {
    const { src } = asked;
    // An address that is none is no reason to load what was there before, or to miss it.
    const badAddress = this.#attributes.isWrong('src');
    if (src === null && badAddress) return;
    const reload = this.#reload && !badAddress;
    if (reload || src !== this.#fetched) {
      if (src !== null && !this.#exhibit.curtain.mayFetch(asked)) {
        if (this.#fetched !== undefined && this.#fetched !== src) this.#forget();
        return;
      }
      this.#reload = false;
      this.#fetched = src;
    }
    const renderOptions = {
      backends: asked.backends ?? BACKENDS,
      // Who names back ends knows better.
      software: asked.backends !== null,
      gamut: asked.gamut,
    };
    if (asked.wasm !== null) setModuleFolder(asked.wasm);
    const credentials = asked.crossOrigin === 'use-credentials' ? 'include' : 'same-origin';
    const { output } = this.#exhibit;
    const light = this.#lighting.setting;
    const { image: picture, ...builtin } = light;
    // Where only the view or the controls are others, nothing is drawn again.
    const drawn = JSON.stringify([src, credentials, renderOptions, output, builtin]);
    if (!reload && drawn === this.#drawn && picture === this.#drawnBy) return;
    this.#drawn = drawn;
    this.#drawnBy = picture;
    this.#session.set({ src, credentials, renderOptions, output, light }, reload);
  }

  get #lighting(): Lighting {
    return this.#exhibit.lighting;
  }

  #tellLight(news: Shining | null): void {
    if (news) this.dispatchEvent(new LightChangeEvent(news.name, news.torch, news.source));
  }

  #lightFaultChanged(fault: PhotoError | null): void {
    this.#showFault();
    // Nothing else ends by it: a photograph goes on loading.
    if (fault && this.isConnected) this.dispatchEvent(new PhotoErrorEvent(fault));
  }

  #showFault(): void {
    const message = this.#attributes.message ?? this.#exhibit.fault;
    const light = this.#lighting.fault?.message ?? this.#lightFault?.message;
    this.#presenter.fault(message ?? light ?? null);
  }

  #clear(): void {
    this.#exhibit.curtain.drawn = false;
    this.#exhibit.fault = null;
    this.#lightFault = null;
    this.#view.clear();
    this.#showFault();
  }

  /** What is shown is not what is asked for any more. */
  #forget(): void {
    this.#session.stop();
    this.#drawn = null;
    this.#drawnBy = null;
    this.#fetched = undefined;
    this.#clear();
  }

  #letGo(): void {
    unwatch(this);
    this.#listening?.abort();
    this.#listening = null;
    this.#exhibit.curtain.near = false;
    this.#exhibit.curtain.seen = false;
    this.#visitor.stop();
    this.#lighting.follow(false, false);
    this.#attributes.clear();
    this.#forget();
  }
}

/** Whether the visitor asks for less motion. */
function motion(): MediaQueryList {
  return matchMedia('(prefers-reduced-motion: reduce)');
}

/** Attributes as properties, and listeners with the element's own events, typed. */
export interface RelightablePhoto extends Reflected {
  addEventListener<K extends keyof RelightablePhotoEventMap>(
    type: K,
    listener: (this: RelightablePhoto, event: RelightablePhotoEventMap[K]) => unknown,
    options?: boolean | AddEventListenerOptions,
  ): void;
  addEventListener(
    type: string,
    listener: EventListenerOrEventListenerObject,
    options?: boolean | AddEventListenerOptions,
  ): void;
  removeEventListener<K extends keyof RelightablePhotoEventMap>(
    type: K,
    listener: (this: RelightablePhoto, event: RelightablePhotoEventMap[K]) => unknown,
    options?: boolean | EventListenerOptions,
  ): void;
  removeEventListener(
    type: string,
    listener: EventListenerOrEventListenerObject,
    options?: boolean | EventListenerOptions,
  ): void;
}

declare global {
  interface HTMLElementTagNameMap {
    'relightable-photo': RelightablePhoto;
  }
}
