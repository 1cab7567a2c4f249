/** `<relightable-photo>`: attributes and pointer in, events and a picture out. */

import { Attributes } from './attributes.js';
import type { CanvasSurface } from './canvas.js';
import { newDecoder } from './decoders.js';
import { draw } from './drawings.js';
import type { Backend, Gamut } from './engine.js';
import { PhotoError } from './errors.js';
import {
  BackendChangeEvent,
  LightChangeEvent,
  loadEvent,
  PhotoErrorEvent,
  progressEvent,
  QualityChangeEvent,
  type RelightablePhotoEventMap,
} from './events.js';
import { LightFollower } from './light-follower.js';
import { checkLightSource, type LightSource } from './light-source.js';
import type { LightSetting } from './lights.js';
import { openPhoto } from './load.js';
import type { Facts } from './photograph.js';
import { Player } from './player.js';
import {
  BACKENDS,
  clampToPicture,
  type PicturePoint,
  parseBackends,
  parseExposure,
  parseGamut,
  parseLight,
  parseTone,
  parseWhiteBalance,
  stepTorch,
} from './settings.js';
import { unwatch, watch } from './sight.js';
import { View } from './view.js';

// On a server there are no elements, but importing this module must not fail there.
const Base = globalThis.HTMLElement ?? (class {} as unknown as typeof HTMLElement);

const ATTRIBUTES = [
  'src',
  'alt',
  'light',
  'backend',
  'exposure',
  'white-balance',
  'tone',
  'gamut',
] as const;
/** Properties that a page may have set before this class was known. */
const PROPERTIES = [
  'src',
  'alt',
  'light',
  'backend',
  'exposure',
  'whiteBalance',
  'tone',
  'gamut',
  'torch',
  'lightSource',
] as const;
const CENTRE: PicturePoint = { x: 0.5, y: 0.5 };

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
}

/**
 * A photograph that can be relit.
 *
 * @fires {Event} load - The photograph is there and drawn.
 * @fires {ProgressEvent} progress - More of the file has come: `loaded` bytes of `total`, which is 0 until known.
 * @fires {PhotoErrorEvent} error - Something failed: `code` for programs, `message` for people, `cause`.
 * @fires {LightChangeEvent} lightchange - The light is another, or the torch has moved: `light`, `torch`, `source`.
 * @fires {BackendChangeEvent} backendchange - A back end was taken up: `backend`, `previous`, `reason`.
 * @fires {QualityChangeEvent} qualitychange - The picture is drawn by another `share` of the photograph.
 *
 * @slot - What browsers show that run no script.
 *
 * @csspart picture - The picture with all that lies over it.
 * @csspart canvas - The canvas that the photograph is drawn on.
 * @csspart progress - The bar that tells how much of the file has come.
 * @csspart message - What went wrong, in words.
 *
 * @cssprop --relightable-photo-background - Behind the picture, and where there is none.
 * @cssprop --relightable-photo-color - Text on that.
 * @cssprop --relightable-photo-accent - The bar of progress.
 * @cssprop --relightable-photo-focus - The ring around what has the keyboard's focus.
 * @cssprop --relightable-photo-aspect - Width / height of the space that is kept until the photograph is there.
 */
// biome-ignore lint/suspicious/noUnsafeDeclarationMerging: the interface only adds overloads of methods that Base has
export class RelightablePhoto extends Base {
  static readonly observedAttributes: readonly string[] = ATTRIBUTES;

  readonly #view: View;
  readonly #player: Player<CanvasSurface>;
  #torch: PicturePoint | null = null;
  #follower: LightFollower | null = null;
  #seen = true;
  #reload = false;
  #scheduled = false;
  readonly #attributes = new Attributes();
  #playerFault: string | null = null;
  #lightFault: PhotoError | null = null;
  /** The light of the last attributes that were right. */
  #lit: LightSetting | null = null;

  constructor() {
    super();
    this.#view = new View(this.attachShadow({ mode: 'open' }));
    this.#player = new Player(
      {
        open: (src, signal, onProgress) =>
          openPhoto(src, signal, onProgress, {
            decoder: newDecoder,
            fetch: (...request) => fetch(...request),
            pause,
          }),
        draw,
        nextFrame: requestAnimationFrame.bind(globalThis),
        later: (ms, callback) => {
          const timer = setTimeout(callback, ms);
          return () => clearTimeout(timer);
        },
        now: () => performance.now(),
      },
      {
        loading: () => {
          this.#playerFault = null;
          this.#lightFault = null;
          this.#view.clear();
          this.#view.progress(Number.NaN);
          this.#showFault();
        },
        progress: (loaded, total) => {
          this.#view.progress(total > 0 ? Math.min(1, loaded / total) : Number.NaN);
          this.dispatchEvent(progressEvent(loaded, total));
        },
        drawn: (fault) => {
          // A light that stays wrong says so once, not at every frame with other numbers.
          if (fault?.code === this.#lightFault?.code) return;
          this.#lightFault = fault;
          this.#lightFaultChanged(fault);
        },
        detailChanged: (detail) => this.dispatchEvent(new QualityChangeEvent(detail)),
        loaded: () => {
          this.#view.progress(null);
          this.dispatchEvent(loadEvent());
        },
        backendChanged: (drawing, backend, previous, reason) => {
          this.#view.show(drawing.canvas);
          this.dispatchEvent(new BackendChangeEvent(backend, previous, reason));
        },
        failed: (error) => {
          this.#playerFault = error.message;
          this.#fail(error);
        },
        recovered: () => {
          this.#playerFault = null;
          this.#showFault();
        },
      },
    );
    this.#listen();
  }

  /** Address of the `.ltm` file. */
  get src(): string {
    return this.getAttribute('src') ?? '';
  }
  set src(value: string) {
    this.setAttribute('src', value);
  }

  /** What the picture shows, in words. */
  get alt(): string {
    return this.getAttribute('alt') ?? '';
  }
  set alt(value: string) {
    this.setAttribute('alt', value);
  }

  /** Name of a built-in light. */
  get light(): string {
    return this.getAttribute('light') ?? 'flood';
  }
  set light(value: string) {
    this.setAttribute('light', value);
  }

  /** Back ends to try, in order, parted by spaces. */
  get backend(): string {
    return this.getAttribute('backend') ?? 'webgpu webgl2 cpu';
  }
  set backend(value: string) {
    this.setAttribute('backend', value);
  }

  /** Factor on the light's brightness. */
  get exposure(): number {
    const value = this.getAttribute('exposure');
    return value === null ? 1 : Number(value);
  }
  set exposure(value: number) {
    this.setAttribute('exposure', String(value));
  }

  /** Factors on red, green and blue. */
  get whiteBalance(): string {
    return this.getAttribute('white-balance') ?? '1 1 1';
  }
  set whiteBalance(value: string) {
    this.setAttribute('white-balance', value);
  }

  /** What becomes of brightness: `clip`, cut off at white, or `filmic`, rolled off before it. */
  get tone(): string {
    return this.getAttribute('tone') ?? 'clip';
  }
  set tone(value: string) {
    this.setAttribute('tone', value);
  }

  /** Colours that the canvas is to show: `srgb` or `display-p3`. */
  get gamut(): string {
    return this.getAttribute('gamut') ?? 'srgb';
  }
  set gamut(value: string) {
    this.setAttribute('gamut', value);
  }

  /** Colours that the canvas shows: those asked for where the browser can; `null` without a picture. */
  get activeGamut(): Gamut | null {
    return this.#player.drawing?.gamut ?? null;
  }

  /** Where the torch shines, on the picture; `null`: over the middle of the light. */
  get torch(): PicturePoint | null {
    return this.#torch;
  }
  set torch(point: PicturePoint | null) {
    if (point && !(Number.isFinite(point.x) && Number.isFinite(point.y))) {
      throw new TypeError('torch must be null or have finite numbers x and y, from 0 to 1');
    }
    this.#torch = point && clampToPicture(point);
    this.#schedule();
  }

  /**
   * What shines in place of the built-in light; `null`, to begin with, where that one does. The built-in
   * light or the last one stays until there is something to be seen, and where something is wrong with
   * the source. Frames of videos and streams are followed while the element is in view. A canvas that is
   * drawn on by WebGL has to have `preserveDrawingBuffer`, as it is looked at after its own frame.
   */
  get lightSource(): LightSource | null {
    return this.#follower?.source ?? null;
  }
  set lightSource(value: LightSource | null) {
    const source = value === null ? null : checkLightSource(value);
    if (source === this.lightSource) {
      this.lightChanged();
      return;
    }
    this.#follower?.stop();
    this.#follower =
      source &&
      new LightFollower(source, {
        changed: () => this.#player.redraw(),
        faultChanged: (fault) => this.#lightFaultChanged(fault),
      });
    this.#lightFault = null;
    this.#schedule();
  }

  /**
   * Looks at the `lightSource` again, in the next frame: canvases, `ImageData` and numbers change without
   * telling.
   */
  lightChanged(): void {
    if (this.#follower) this.#player.redraw();
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
   * Draws the picture as it is set now, in full detail, and encodes it. Rejects with `not-loaded` while there is no
   * photograph, and where another takes its place meanwhile.
   */
  async toBlob({ type = 'image/png', quality }: BlobOptions = {}): Promise<Blob> {
    this.#update();
    // The canvas of a GPU keeps its content only until the browser has shown it.
    return (await this.#player.renderNow()).toBlob(type, quality);
  }

  connectedCallback(): void {
    // Properties that were set before this class was known hide its setters.
    for (const name of PROPERTIES) {
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
    this.#schedule();
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
      unwatch(this);
      this.#follower?.stop();
      this.#player.stop();
      this.#view.clear();
      this.#attributes.clear();
      this.#playerFault = null;
      this.#lightFault = null;
      return;
    }
    watch(this, (seen) => {
      this.#seen = seen;
      this.#player.setVisible(seen);
      this.#follow();
    });
    this.#follow();
    const read = <T>(name: string, parse: (value: string | null) => T): T =>
      this.#attributes.read(name, this.getAttribute(name), parse);
    const name = read('light', parseLight);
    const order = read('backend', parseBackends);
    const look = {
      exposure: read('exposure', parseExposure),
      whiteBalance: read('white-balance', parseWhiteBalance),
      tone: read('tone', parseTone),
    };
    const wanted = {
      backends: order ?? BACKENDS,
      // Who names back ends knows better.
      software: order !== null,
      gamut: read('gamut', parseGamut),
    };
    const src = read('src', (value) => this.#address(value));
    const lit = this.#lit;
    const torch = name === 'torch' ? this.#torch : null;
    const picture = this.#follower?.picture ?? null;
    const light = { name, torch, picture };
    this.#lit = light;
    this.#describe();
    this.#showFault();
    for (const fault of this.#attributes.takeFaults()) {
      this.dispatchEvent(new PhotoErrorEvent(fault));
    }
    // An address that is none is no reason to load what was there before, or to miss it.
    const badAddress = this.#attributes.isWrong('src');
    const reload = this.#reload && !badAddress;
    this.#reload = false;
    if (src !== null || !badAddress) this.#player.set({ src, wanted, look, light }, reload);
    if (lit && !sameLight(lit, light)) {
      const moved = picture ? null : torch;
      this.dispatchEvent(new LightChangeEvent(name, moved, this.lightSource));
    }
  }

  /** Keeps up with the source of light while it matters. */
  #follow(): void {
    if (this.#seen && this.isConnected) this.#follower?.start();
    else this.#follower?.stop();
  }

  get #holdsTorch(): boolean {
    return this.#lit?.name === 'torch' && !this.#lit.picture;
  }

  #describe(): void {
    this.#view.describe(this.getAttribute('alt'), this.#holdsTorch);
  }

  #address(value: string | null): string | null {
    const src = value?.trim();
    if (!src) return null;
    try {
      return new URL(src, this.baseURI).href;
    } catch (cause) {
      throw new PhotoError('attribute', `The address “${src}” in src is not a URL.`, cause);
    }
  }

  #fail(error: PhotoError): void {
    this.#view.progress(null);
    this.#showFault();
    this.dispatchEvent(new PhotoErrorEvent(error));
  }

  /** Nothing else ends by it: a photograph goes on loading. */
  #lightFaultChanged(fault: PhotoError | null): void {
    this.#showFault();
    if (fault) this.dispatchEvent(new PhotoErrorEvent(fault));
  }

  #showFault(): void {
    const source = this.#follower?.fault?.message;
    this.#view.message(
      this.#attributes.message ?? this.#playerFault ?? source ?? this.#lightFault?.message ?? null,
    );
  }

  #listen(): void {
    const { picture } = this.#view;
    const holdsTorch = () => this.#holdsTorch && this.activeBackend !== null;
    const follow = (event: PointerEvent) => {
      if (!holdsTorch()) return;
      const { left, top, width, height } = picture.getBoundingClientRect();
      if (width === 0 || height === 0) return;
      this.torch = { x: (event.clientX - left) / width, y: (event.clientY - top) / height };
    };
    picture.addEventListener('pointermove', follow);
    picture.addEventListener('pointerdown', (event) => {
      if (!holdsTorch() || !event.isPrimary || event.button !== 0) return;
      follow(event);
      // A drag that leaves the picture keeps the torch at its edge. (A pointer that a script made up
      // cannot be captured.)
      if (event.isTrusted) picture.setPointerCapture(event.pointerId);
    });
    picture.addEventListener('keydown', (event) => {
      if (!holdsTorch() || event.ctrlKey || event.metaKey || event.altKey) return;
      const moved = stepTorch(this.#torch ?? CENTRE, event.key, event.shiftKey);
      if (!moved) return;
      event.preventDefault();
      this.torch = moved;
    });
  }
}

/** Under a picture, built-in lights do not shine. */
function sameLight(a: LightSetting, b: LightSetting): boolean {
  if (a.picture || b.picture) return a.picture === b.picture;
  return a.name === b.name && a.torch === b.torch;
}

/** Gives the page its turn. */
function pause(): Promise<void> {
  const { scheduler } = globalThis as { scheduler?: { yield?: () => Promise<void> } };
  return scheduler?.yield?.() ?? new Promise((resolve) => setTimeout(resolve));
}

/** Listeners with the element's own events, typed. */
export interface RelightablePhoto {
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
