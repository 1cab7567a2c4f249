/** `<relightable-photo>`: attributes and visitors in, events and a picture out. */

import { type Asked, readAsked } from './asked.js';
import { Attributes } from './attributes.js';
import { blobOf, type CanvasSurface, resampled } from './canvas.js';
import { Controls } from './controls.js';
import { Curtain } from './curtain.js';
import type { Backend, Gamut } from './engine.js';
import type { PhotoError } from './errors.js';
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
import { languageAt } from './language.js';
import { checkLightSource, isLightSource, type LightSource } from './light-source.js';
import { lightWords } from './light-words.js';
import { Lighting } from './lighting.js';
import type { Facts } from './photograph.js';
import { Player } from './player.js';
import { PORTS } from './ports.js';
import { ATTRIBUTES, PROPERTIES, type Reflected, reflect } from './reflect.js';
import {
  BACKENDS,
  CENTRE,
  clampToPicture,
  type LightName,
  type PicturePoint,
  parseLight,
} from './settings.js';
import { unwatch, watch } from './sight.js';
import { readState, writeState } from './state.js';
import { mayTilt } from './tilting.js';
import { browserColor, parseColor, tinted } from './tint.js';
import type { ToolbarState } from './toolbar.js';
import { View } from './view.js';
import { clampView, type PhotoView, sameView, WHOLE } from './viewport.js';
import { Visitor } from './visitor.js';
import { fetchTranslations, isMissing, type Language, say } from './words.js';

// On a server there are no elements, but importing this module must not fail there.
const Base = globalThis.HTMLElement ?? (class {} as unknown as typeof HTMLElement);

/** What is known of a photograph once it has loaded. */
export interface PhotoInfo extends Omit<Facts, 'metadata'> {
  /** What the file says of itself. */
  readonly metadata: unknown;
}

/** Options of `toBlob`. */
export interface BlobOptions {
  /** MIME type; a PNG, which is exact, unless another is asked for. */
  readonly type?: string;
  /** 0 to 1, for types that lose some. */
  readonly quality?: number;
  /** Factor on the picture's pixels along either side, up to 4. */
  readonly scale?: number;
}

/** What `setLight` takes of a built-in light. What is left out stays. */
export interface LightPose {
  readonly name?: LightName;
  /** Where a torch shines, 0 to 1 across the picture, */
  readonly x?: number;
  /** and down. */
  readonly y?: number;
  /** Radius of a torch, as a fraction of the light plane's shorter side. */
  readonly size?: number;
  /** Any CSS colour. */
  readonly color?: string;
}

/** What shines, as it is told. */
interface Shining {
  readonly name: LightName;
  readonly torch: PicturePoint | null;
  readonly source: LightSource | null;
}

const MAX_SCALE = 4;

/** Attributes that take the place of what a visitor chose. */
const OVERRULES = {
  light: 'name',
  'light-src': 'name',
  'light-x': 'torch',
  'light-y': 'torch',
  'light-size': 'size',
  'light-color': 'color',
} as const;

/**
 * A photograph that can be relit.
 *
 * Fires `load`, `progress`, `error`, `lightchange`, `viewchange`, `backendchange`, `contextlost` and
 * `qualitychange`. Takes the slots `poster`, `progress`, `controls` and `error`. Style it by
 * `::part()` of picture, canvas, poster, progress, message, controls, menu, button, torch-handle, hint
 * and status, and by the custom properties `--relightable-photo-background`, `-color`, `-accent`,
 * `-focus` and `-aspect`, the last being the space kept until the photograph is there.
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
  readonly #player: Player<CanvasSurface>;
  readonly #attributes = new Attributes();
  readonly #curtain = new Curtain();
  readonly #lighting = new Lighting({
    changed: () => this.#player.redraw(),
    faultChanged: (fault) => this.#lightFaultChanged(fault),
  });
  #asked: Asked | null = null;
  #part = WHOLE;
  #toldPart = WHOLE;
  #told: Shining | null = null;
  #exposure: number | null = null;
  /** Whether somebody had things stop or go on that move by themselves. */
  #paused: boolean | null = null;
  #language: Language = 'en';
  /** The address that was given to the player. */
  #fetched: string | null | undefined;
  #reload = false;
  #scheduled = false;
  #listening: AbortController | null = null;
  #playerFault: string | null = null;
  #lightFault: PhotoError | null = null;

  constructor() {
    super();
    const root = this.attachShadow({ mode: 'open' });
    this.#view = new View(root);
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
        fullscreen: () => this.#toggleFullscreen(),
      },
      () => this.#schedule(),
      (error) => this.dispatchEvent(new PhotoErrorEvent(error)),
    );
    this.#player = this.#newPlayer();
    this.#visitor = this.#newVisitor(root);
    this.#view.revealButton.addEventListener('click', () => {
      this.#visitor.touch();
      this.dismissPoster();
    });
    this.addEventListener('fullscreenchange', () => this.#schedule());
  }

  /** Colours that the canvas shows: those asked for where the browser can; `null` without a picture. */
  get activeGamut(): Gamut | null {
    return this.#player.drawing?.gamut ?? null;
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
    return this.#part;
  }
  set view(view: PhotoView) {
    if (![view?.zoom, view?.x, view?.y].every(Number.isFinite)) {
      throw new TypeError('view must have finite numbers zoom, from 1, and x and y, from 0 to 1');
    }
    this.#part = clampView(view, this.zoom);
    this.#schedule();
  }

  /** Whether what moves by itself stands still: fire, the film of `light-src`, the wandering torch. */
  get paused(): boolean {
    return this.#paused ?? motion().matches;
  }
  set paused(paused: boolean) {
    this.#paused = paused;
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
    if (this.#lighting.shining) this.#player.redraw();
  }

  /**
   * Has a light shine until `reset`, or until an attribute asks for another: a built-in one by its name, with
   * its place, size and colour if need be, or a source, as by `lightSource`. `null`: the page's own, without a source.
   */
  setLight(light: LightName | LightPose | LightSource | null): void {
    if (light === null) {
      this.lightSource = null;
      this.#lighting.reset();
    } else if (typeof light === 'string') {
      this.setLight({ name: light });
      return;
    } else if (isLightSource(light)) {
      this.lightSource = light;
      return;
    } else {
      const { name, x, y, size, color } = light;
      const torch = this.torch ?? CENTRE;
      const placed = x !== undefined || y !== undefined;
      this.#lighting.choose({
        ...(name !== undefined && { name: parseLight(name) }),
        ...(placed && { torch: clampToPicture({ x: x ?? torch.x, y: y ?? torch.y }) }),
        ...(size !== undefined && { size }),
        ...(color !== undefined && { color: parseColor(color, browserColor) }),
      });
    }
    this.#schedule();
  }

  /** Light and view as the attributes and `lightSource` say. */
  reset(): void {
    this.#visitor.reset();
    this.#lighting.reset();
    this.#part = WHOLE;
    this.#exposure = null;
    this.#paused = null;
    this.#schedule();
  }

  /** Light and view in a few letters, all of which addresses may hold. What a source shows is not among it. */
  getState(): string {
    const exposure = this.#exposure ?? this.exposure;
    const asked = this.#asked ?? this.#read();
    this.#lighting.ask(asked.light, asked.crossOrigin);
    const { item, torch, size, color } = this.#lighting;
    return writeState({
      light: item === 'projection' ? null : item,
      torch: item === 'torch' ? torch : null,
      size: item === 'torch' ? size : null,
      color: color?.hex ?? null,
      exposure: exposure === 1 ? null : exposure,
      view: this.#part,
    });
  }

  /** Takes what `getState` gave, here or at another element. What it does not tell is as the page asks. */
  setState(text: string): void {
    const { state, faults } = readState(text);
    this.reset();
    this.#lighting.choose({
      name: state.light,
      torch: state.torch && clampToPicture(state.torch),
      size: state.size,
      color: parseColor(state.color, browserColor),
    });
    this.#exposure = state.exposure;
    this.#part = clampView(state.view, this.zoom);
    for (const fault of faults) this.dispatchEvent(new PhotoErrorEvent(fault));
  }

  /** Has the poster give way, as soon as there is a picture. */
  dismissPoster(): void {
    this.#curtain.lifted = true;
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
    return this.#player.backend;
  }

  /**
   * The share of the photograph that the picture is drawn by, the most important of it first: 1, or less
   * while it moves faster than all of it can be drawn. `null` while there is no picture.
   */
  get detail(): number | null {
    return this.#player.detail;
  }

  /** What the back end says of itself: the kernel, the adapter. */
  get kernel(): string | null {
    return this.#player.drawing?.kernel ?? null;
  }

  /** What is known of the photograph, `null` until it is decoded. */
  get info(): PhotoInfo | null {
    const facts = this.#player.photo?.facts;
    return facts ? { ...facts, metadata: JSON.parse(facts.metadata) as unknown } : null;
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
    const drawing = await this.#player.renderNow();
    // The canvas of a GPU keeps its content only until the browser has shown it.
    if (scale === 1) return drawing.toBlob(type, quality);
    return blobOf(resampled(drawing.canvas, scale, drawing.gamut), type, quality);
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
    if (name in OVERRULES) {
      this.#lighting.choose({ [OVERRULES[name as keyof typeof OVERRULES]]: null });
    }
    this.#schedule();
  }

  #newPlayer(): Player<CanvasSurface> {
    return new Player(PORTS, {
      loading: () => {
        this.#clear();
        this.#view.progress(Number.NaN);
      },
      progress: (loaded, total) => {
        this.#view.progress(total > 0 ? Math.min(1, loaded / total) : Number.NaN);
        this.dispatchEvent(progressEvent(loaded, total));
      },
      drawn: ({ asked, fault }, light) => {
        if (!this.#curtain.drawn) {
          this.#curtain.drawn = true;
          this.#schedule();
        }
        if (asked && light.picture && light.picture === this.#lighting.setting.picture) {
          this.#tellLight();
        }
        // A light that stays wrong says so once, not at every frame with other numbers.
        if (fault?.code === this.#lightFault?.code) return;
        this.#lightFault = fault;
        this.#lightFaultChanged(fault);
      },
      detailChanged: (detail) => this.dispatchEvent(new QualityChangeEvent(detail)),
      loaded: () => {
        this.#view.progress(null);
        this.#view.tell(say('loaded', this.#language));
        this.dispatchEvent(loadEvent());
      },
      drawingChanged: (drawing) => {
        this.#view.show(drawing.canvas);
        this.#schedule();
      },
      backendChanged: (backend, previous, reason) => {
        this.dispatchEvent(new BackendChangeEvent(backend, previous, reason));
      },
      lost: (backend, message) => this.dispatchEvent(new ContextLostEvent(backend, message)),
      failed: (error) => {
        this.#playerFault = error.message;
        this.#view.progress(null);
        this.#schedule();
        this.#showFault();
        this.dispatchEvent(new PhotoErrorEvent(error));
      },
      recovered: () => {
        this.#playerFault = null;
        this.#schedule();
      },
    });
  }

  #newVisitor(root: ShadowRoot): Visitor {
    const element = this;
    return new Visitor(root, this.#view, {
      lighting: this.#lighting,
      get view() {
        return element.#part;
      },
      set view(view) {
        if (sameView(view, element.#part)) return;
        element.#part = view;
        const zoom = view.zoom.toLocaleString(element.#language, { maximumFractionDigits: 1 });
        element.#view.tell(say('zoomed', element.#language, zoom));
        element.#schedule();
      },
      get mostZoom() {
        return element.#asked?.zoom ?? 1;
      },
      get cooperative() {
        return element.#asked?.cooperative ?? false;
      },
      get shown() {
        return element.#shown;
      },
      get plays() {
        return !element.paused;
      },
      get breathes() {
        return element.#asked?.breathes ?? false;
      },
      changed: () => this.#schedule(),
      lightChosen: () => {
        this.#view.tell(
          `${say('light', this.#language)}: ${say(this.#lighting.item, this.#language)}`,
        );
        this.#schedule();
      },
      leave: () => {
        if (this.matches(':fullscreen')) this.#toggleFullscreen();
        else (this.shadowRoot?.activeElement as HTMLElement | null)?.blur();
      },
      hint: (by) => {
        const key = /mac|iphone|ipad/i.test(navigator.platform) ? '⌘' : 'Ctrl';
        const word = by === 'wheel' ? 'wheelHint' : 'touchHint';
        this.#view.hint(say(word, this.#language, key));
      },
      expired: () => {
        this.reset();
        this.#controls.close();
        if (this.matches(':fullscreen')) this.#toggleFullscreen();
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
      this.#curtain[sight] = is;
      if (sight === 'seen') this.#player.setVisible(is);
      this.#schedule();
    });
    const asked = this.#read();
    this.#lighting.ask(asked.light, asked.crossOrigin);
    this.#lighting.follow(this.#curtain.seen, !this.paused);
    this.#part = clampView(this.#part, asked.zoom);
    this.#language = languageAt(this);
    if (isMissing(this.#language)) void fetchTranslations().then(() => this.#schedule());
    this.#present(asked);
    for (const fault of this.#attributes.takeFaults()) {
      this.dispatchEvent(new PhotoErrorEvent(fault));
    }
    this.#load(asked);
    if (!this.#told || !this.#lighting.shining) this.#tellLight();
    if (!sameView(this.#part, this.#toldPart)) {
      this.#toldPart = this.#part;
      this.dispatchEvent(new ViewChangeEvent(this.#part));
    }
  }

  #read(): Asked {
    this.#asked = readAsked(this, this.#attributes, browserColor);
    return this.#asked;
  }

  /** Has the player do what is asked for, as soon as the photograph may be fetched. */
  #load(asked: Asked): void {
    const { src } = asked;
    // An address that is none is no reason to load what was there before, or to miss it.
    const badAddress = this.#attributes.isWrong('src');
    if (src === null && badAddress) return;
    const reload = this.#reload && !badAddress;
    if (reload || src !== this.#fetched) {
      if (src !== null && !this.#curtain.mayFetch(asked)) {
        if (this.#fetched !== undefined && this.#fetched !== src) this.#forget();
        return;
      }
      this.#reload = false;
      this.#fetched = src;
    }
    const tint = asked.light.color?.tint;
    const color = this.#lighting.color?.tint ?? tint;
    const whiteBalance = color ? tinted(asked.whiteBalance, color) : asked.whiteBalance;
    const wanted = {
      backends: asked.backends ?? BACKENDS,
      // Who names back ends knows better.
      software: asked.backends !== null,
      gamut: asked.gamut,
    };
    const look = {
      exposure: this.#exposure ?? asked.exposure,
      whiteBalance,
      tone: asked.tone,
    };
    this.#player.set({ src, wanted, look, light: this.#lighting.setting }, reload);
  }

  /** Shows all of it but the picture itself. */
  #present(asked: Asked): void {
    const { zoom, cooperative, poster, crossOrigin } = asked;
    const light = this.#shown && this.#lighting.holdsTorch;
    const zooms = this.#shown && zoom > 1;
    const zoomed = this.#part.zoom > 1;
    const at = this.#lighting.torch ?? CENTRE;
    this.#view.describe(this.getAttribute('alt'), this.#language);
    const holds = zooms && !cooperative && (light || zoomed);
    const touch = holds ? 'hold' : light || zooms ? 'scroll' : 'page';
    this.#view.arrange({ light, focusable: zooms && !light, zoomed, touch }, this.#language);
    this.#view.place(this.#part, at, lightWords(at, this.#language));
    const covered = this.#playerFault !== null || this.#curtain.isDown(asked);
    this.#view.poster(poster, crossOrigin, covered, this.#curtain.awaitsPress(asked));
    this.#showFault();
    this.#controls.update(asked.controls && this.#shown ? this.#controlsState(asked) : null);
    this.#visitor.update(this.#curtain.seen, asked.kiosk);
  }

  #controlsState({ zoom: most, breathes }: Asked): ToolbarState {
    const { items, item, holdsTorch, canPlay } = this.#lighting;
    const { zoom } = this.#part;
    return {
      language: `${this.#language} ${isMissing(this.#language)}`,
      say: (word) => say(word, this.#language),
      items,
      item,
      plays: canPlay || (holdsTorch && breathes) ? !this.paused : null,
      zoom: most > 1 ? { in: zoom < most, out: zoom > 1 } : null,
      tilts: holdsTorch && mayTilt() ? this.#visitor.tilts : null,
      fullscreen: document.fullscreenEnabled ? this.matches(':fullscreen') : null,
    };
  }

  /** Whether there is a picture to be seen and touched. */
  get #shown(): boolean {
    const { drawn } = this.#curtain;
    return drawn && !!this.#asked && !this.#curtain.isDown(this.#asked) && !this.#playerFault;
  }

  #tellLight(): void {
    const { name, torch, picture } = this.#lighting.setting;
    const drawn = picture !== null && this.#told !== null;
    const source = drawn ? this.#lighting.shining : null;
    const now = { name, torch: source ? null : torch, source };
    const before = this.#told;
    this.#told = now;
    if (before && !sameShining(before, now)) {
      this.dispatchEvent(new LightChangeEvent(name, now.torch, source));
    }
  }

  #lightFaultChanged(fault: PhotoError | null): void {
    this.#showFault();
    // Nothing else ends by it: a photograph goes on loading.
    if (fault) this.dispatchEvent(new PhotoErrorEvent(fault));
  }

  #showFault(): void {
    const source = this.#lighting.fault?.message;
    const message =
      this.#attributes.message ?? this.#playerFault ?? source ?? this.#lightFault?.message;
    const fatal = this.#playerFault !== null;
    this.#view.fault(message === undefined ? null : { fatal, message }, this.#language);
  }

  #toggleFullscreen(): void {
    // Refused where the page's own frame, or the visitor, does not allow it.
    const done = this.matches(':fullscreen') ? document.exitFullscreen() : this.requestFullscreen();
    void done.catch(() => {});
  }

  #clear(): void {
    this.#curtain.drawn = false;
    this.#playerFault = null;
    this.#lightFault = null;
    this.#view.clear();
    this.#showFault();
  }

  /** What is shown is not what is asked for any more. */
  #forget(): void {
    this.#player.stop();
    this.#fetched = undefined;
    this.#clear();
  }

  #letGo(): void {
    unwatch(this);
    this.#listening?.abort();
    this.#listening = null;
    this.#curtain.near = false;
    this.#curtain.seen = false;
    this.#visitor.stop();
    this.#lighting.follow(false, false);
    this.#attributes.clear();
    this.#forget();
  }
}

/** Under a source, built-in lights do not shine. */
function sameShining(a: Shining, b: Shining): boolean {
  if (a.source || b.source) return a.source === b.source;
  return a.name === b.name && a.torch?.x === b.torch?.x && a.torch?.y === b.torch?.y;
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
