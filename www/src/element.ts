/** `<relightable-photo>`: attributes and pointer in, events and a picture out. */

import { newDecoder } from './decoders.js';
import { type Backend, loadEngine } from './engine.js';
import { PhotoError, toPhotoError } from './errors.js';
import {
  BackendChangeEvent,
  LightChangeEvent,
  loadEvent,
  PhotoErrorEvent,
  progressEvent,
  type RelightablePhotoEventMap,
} from './events.js';
import { openPhoto } from './load.js';
import { type LightSetting, Player } from './player.js';
import {
  clampToPicture,
  type PicturePoint,
  parseBackends,
  parseExposure,
  parseLight,
  stepTorch,
} from './settings.js';
import { CanvasDrawing } from './surface.js';
import { View } from './view.js';

// On a server there are no elements, but importing this module must not fail there.
const Base = globalThis.HTMLElement ?? (class {} as unknown as typeof HTMLElement);

const ATTRIBUTES = ['src', 'alt', 'light', 'backend', 'exposure'] as const;
const CENTRE: PicturePoint = { x: 0.5, y: 0.5 };

/** What is known of a photograph once it has loaded. */
export interface PhotoInfo {
  /** Picture, in pixels. */
  readonly width: number;
  readonly height: number;
  /** Light plane, in elements. */
  readonly lightWidth: number;
  readonly lightHeight: number;
  /** Memory its light transport takes, in bytes. */
  readonly decodedBytes: number;
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
 * Fires `load`, `progress`, `error`, `lightchange` and `backendchange`. Style it by `::part(picture)`,
 * `::part(canvas)`, `::part(progress)` and `::part(message)`, and by the custom properties
 * `--relightable-photo-background`, `-color`, `-accent`, `-focus` and `-aspect`, the last being the
 * space kept until the photograph is there.
 */
// biome-ignore lint/suspicious/noUnsafeDeclarationMerging: the interface only adds overloads of methods that Base has
export class RelightablePhoto extends Base {
  static readonly observedAttributes: readonly string[] = ATTRIBUTES;

  readonly #view: View;
  readonly #player: Player<CanvasDrawing>;
  #torch: PicturePoint | null = null;
  #reload = false;
  #scheduled = false;
  #attributeFault: string | null = null;
  #playerFault: string | null = null;
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
        draw: async (backend, photo, lost) =>
          CanvasDrawing.create(await loadEngine(), backend, photo, lost),
        nextFrame: requestAnimationFrame.bind(globalThis),
      },
      {
        loading: () => {
          this.#playerFault = null;
          this.#view.clear();
          this.#view.progress(Number.NaN);
          this.#showFault();
        },
        progress: (loaded, total) => {
          this.#view.progress(total > 0 ? Math.min(1, loaded / total) : Number.NaN);
          this.dispatchEvent(progressEvent(loaded, total));
        },
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

  /** The back end that draws, `null` while there is none. */
  get activeBackend(): Backend | null {
    return this.#player.backend;
  }

  /** What the back end says of itself: the kernel, the adapter. */
  get kernel(): string | null {
    return this.#player.drawing?.kernel ?? null;
  }

  /** What is known of the photograph, `null` until it is decoded. */
  get info(): PhotoInfo | null {
    const photo = this.#player.photo;
    if (!photo) return null;
    const { width, height, lightWidth, lightHeight, decodedBytes } = photo;
    const metadata: unknown = JSON.parse(photo.metadata);
    return { width, height, lightWidth, lightHeight, decodedBytes, metadata };
  }

  /** Draws the picture as it is set now and encodes it. Rejects with `not-loaded` before `load`. */
  async toBlob({ type = 'image/png', quality }: BlobOptions = {}): Promise<Blob> {
    this.#update();
    // The canvas of a GPU keeps its content only until the browser has shown it.
    return this.#player.renderNow().toBlob(type, quality);
  }

  connectedCallback(): void {
    // Properties that were set before this class was known hide its setters.
    for (const name of [...ATTRIBUTES, 'torch'] as const) {
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
      this.#player.stop();
      this.#view.clear();
      this.#attributeFault = null;
      this.#playerFault = null;
      return;
    }
    try {
      const name = parseLight(this.getAttribute('light'));
      const backends = parseBackends(this.getAttribute('backend'));
      const exposure = parseExposure(this.getAttribute('exposure'));
      const src = this.#address();
      this.#attributeFault = null;
      this.#showFault();
      const lit = this.#lit;
      const light = { name, torch: name === 'torch' ? this.#torch : null };
      this.#lit = light;
      this.#describe();
      const reload = this.#reload;
      this.#reload = false;
      this.#player.set({ src, backends, exposure, light }, reload);
      if (lit && (lit.name !== light.name || lit.torch !== light.torch)) {
        this.dispatchEvent(new LightChangeEvent(light.name, light.torch));
      }
    } catch (thrown) {
      this.#describe();
      const error = toPhotoError(thrown);
      if (error.message === this.#attributeFault) return;
      this.#attributeFault = error.message;
      this.#fail(error);
    }
  }

  #describe(): void {
    this.#view.describe(this.getAttribute('alt'), this.#lit?.name === 'torch');
  }

  #address(): string | null {
    const src = this.getAttribute('src')?.trim();
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

  #showFault(): void {
    this.#view.message(this.#attributeFault ?? this.#playerFault);
  }

  #listen(): void {
    const { picture } = this.#view;
    const holdsTorch = () => this.#lit?.name === 'torch' && this.activeBackend !== null;
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
