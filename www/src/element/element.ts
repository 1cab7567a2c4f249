/** `<relightable-photo>`: the public interface. The class delegates to `ElementController`. */

import { moduleFolder, setModuleFolder, toModuleFolder } from '../engine/wasm-loader.js';
import { addTranslation, type Translation } from '../i18n/translations.js';
import type { TransitionOptions } from '../input/transitions.js';
import type { PhotographSource } from '../photo/types.js';
import type { PhotoError } from '../shared/errors.js';
import type { Backend, Gamut, LightName } from '../shared/keywords.js';
import type { PhotoInfo, PicturePoint } from '../shared/value-types.js';
import type { LightValue } from '../state/page-light.js';
import {
  type PictureRect,
  pointAt,
  positionOf,
  type ViewChange,
  type ZoomView,
} from '../state/viewport.js';
import { ElementController } from './element-controller.js';
import { encodePicture } from './encode-picture.js';
import type { RelightablePhotoEventMap } from './events.js';
import { ATTRIBUTES, PROPERTIES, type ReflectedProperties, reflect } from './reflect.js';

// Servers have no HTMLElement, but importing this module must work there.
const Base = globalThis.HTMLElement ?? (class {} as unknown as typeof HTMLElement);

export type { PhotoInfo } from '../shared/value-types.js';

/** Options of `toBlob`. */
export interface ToBlobOptions {
  /** MIME type; `image/png`, which is lossless, by default. */
  readonly type?: string;
  /** Quality of lossy types, 0 to 1. */
  readonly quality?: number;
  /** Factor on the picture's width and height, up to 4. */
  readonly scale?: number;
}

const MAX_SCALE = 4;

/** Options of `getState` and `setState`. */
export interface StateOptions {
  /** Begins each key, so that one address can hold the states of several photographs. */
  readonly prefix?: string;
}

/**
 * Shows a photograph that visitors can relight.
 *
 * @fires {Event} load - The whole photograph is drawn.
 * @fires {ProgressEvent} progress - More of the file has arrived: `loaded` bytes of `total`, which is 0 while unknown.
 * @fires {PhotoErrorEvent} error - There is no picture: `code` for programs, `message` for people, `cause`.
 * @fires {PhotoWarningEvent} warning - Something else does not work as requested, such as an invalid attribute, a light source that fails, or a lost graphics device: `code`, `message`, `cause`.
 * @fires {LightChangeEvent} lightchange - Another light is active, or the torch has moved: `light`, `torch`, `source`. A source is reported when it first lights the picture.
 * @fires {ViewChangeEvent} viewchange - Another part of the picture is visible: `zoom`, `x`, `y`.
 * @fires {BackendChangeEvent} backendchange - A backend is in use: `backend`, `previous`, `reason`.
 * @fires {ContextLostEvent} contextlost - The backend in use was lost: `backend`, `message`. A `backendchange` follows.
 * @fires {QualityChangeEvent} qualitychange - The picture is drawn with another share of the photograph: `quality`.
 *
 * @attr {string} light - Built-in light: `flood` (all light elements; the default), `torch`, `checkerboard`, `stripes`, `spectrum` or `fire` (animated).
 *
 * @slot - Content that is shown until the element's script has run, by old browsers, and by browsers without scripts.
 * @slot poster - Replaces the `poster` image, until the photograph is drawn.
 * @slot progress - Replaces the progress bar, while the file loads.
 * @slot overlay - Lies over the picture and follows zoom, `object-fit` and full screen. Positions in percent are those of
 *   the picture.
 * @slot controls - Replaces the toolbar.
 * @slot error - Replaces the error message.
 *
 * @cssstate loading - The photograph is being loaded.
 * @cssstate ready - The whole photograph is drawn.
 * @cssstate error - There is no picture.
 *
 * @csspart picture - The picture and everything that lies over it.
 * @csspart canvas - The canvas with the photograph.
 * @csspart poster - The poster image.
 * @csspart progress - The progress bar.
 * @csspart message - The error message.
 * @csspart retry - The button that loads the photograph again.
 * @csspart controls - The toolbar.
 * @csspart menu - The light menu.
 * @csspart button - Each button.
 * @csspart torch-handle - The torch, for the keyboard's focus.
 * @csspart minimap - The overview that `minimap` asks for.
 * @csspart hint - The hint that explains how to zoom with `cooperative-gestures`.
 * @csspart status - The announcements for screen readers.
 *
 * @cssprop --relightable-photo-background - Background of the picture, and of its place before it is drawn.
 * @cssprop --relightable-photo-color - Text on that background.
 * @cssprop --relightable-photo-accent - The progress bar and the selected button.
 * @cssprop --relightable-photo-focus - The focus ring.
 */
// biome-ignore lint/suspicious/noUnsafeDeclarationMerging: the interface adds the properties that `reflect` defines, and typed overloads of inherited methods
export class RelightablePhotoElement extends Base {
  static readonly observedAttributes: readonly string[] = [...ATTRIBUTES, 'lang'];

  /** Folder of the WebAssembly modules for the whole page; `null` for the one beside the script. Set it before the first photograph loads. */
  static get wasmUrl(): string | null {
    return moduleFolder;
  }
  static set wasmUrl(url: string | URL | null) {
    setModuleFolder(url ? toModuleFolder(url) : null);
  }

  /**
   * Adds a language, or replaces single texts of one, for all photographs of the page. Absent texts are those of the
   * element's own translation, or English.
   */
  static addTranslation(lang: string, strings: Translation): void {
    addTranslation(lang, strings);
  }

  static {
    reflect(RelightablePhotoElement.prototype);
  }

  readonly #controller = new ElementController<RelightablePhotoElement>(this);
  readonly #state = this.#controller.state;
  readonly #session = this.#controller.session;

  readonly #status = this.#controller.status;

  /** Whether nothing is left to load: the whole photograph is drawn, loading has failed, or there is no photograph. */
  get complete(): boolean {
    return (
      !(this.photograph || this.src) ||
      this.#status.phase === 'ready' ||
      this.#status.phase === 'error'
    );
  }

  /** Why there is no picture; `null` unless the last `load` failed. */
  get error(): PhotoError | null {
    return this.#status.error;
  }

  /**
   * Resolves to the element once the whole photograph is drawn, and rejects with a `PhotoError` if that fails. After it
   * has settled, another load makes another promise.
   */
  get ready(): Promise<this> {
    return this.#status.ready as Promise<this>;
  }

  /**
   * A photograph that is not a file, such as `recover()` gives, in place of that of `src`. Setting `src`, or `null`, returns
   * to `src`.
   */
  get photograph(): PhotographSource | null {
    return this.#controller.photograph;
  }
  set photograph(source: PhotographSource | null) {
    this.#controller.setPhotograph(source ?? null);
  }

  /** Loads the photograph again, for example after an error. */
  load(): void {
    this.#controller.load();
  }

  /** The colour space of the canvas; `null` without a picture. */
  get activeGamut(): Gamut | null {
    return this.#session.renderer?.gamut ?? null;
  }

  /** The current built-in light, or the one that a source replaces. A visitor may have selected it. */
  get activeLight(): LightName {
    return this.#state.light.name;
  }

  /**
   * The torch's position on the picture, `{ x, y }`; `null` behind the centre of the light plane. Absent fields keep
   * their values.
   */
  get torch(): PicturePoint | null {
    return this.#state.light.torch;
  }
  set torch(point: Partial<PicturePoint> | null) {
    this.#controller.setTorch(point);
  }

  /**
   * The visible part of the picture, `{ zoom, x, y }`: a magnification of at most `zoom`, and its centre. Absent fields
   * keep their values. With `scale` in place of `zoom`, a pixel of the picture is `scale` pixels of the screen wide.
   */
  get view(): ZoomView {
    return this.#state.view;
  }
  set view(view: ViewChange) {
    this.#controller.setView(view);
  }

  /**
   * Sets `light`, and moves the torch from its current position to that of `light` in `duration` milliseconds, 600 by
   * default. Resolves at the end, or earlier if a visitor or a script changes the light. The torch jumps if less motion
   * is preferred, and where nobody sees it.
   */
  lightTo(light: LightValue, options: TransitionOptions = {}): Promise<void> {
    return this.#controller.lightTo(light, options);
  }

  /**
   * Moves to another `view`, or to the part of the picture `{ x, y, width, height }`, whose corner and size are fractions of
   * the picture. Resolves as `lightTo` does.
   */
  viewTo(view: ViewChange | PictureRect, options: TransitionOptions = {}): Promise<void> {
    return this.#controller.viewTo(view, options);
  }

  /**
   * The point of the picture, 0 to 1, at a position in pixels from the element's top left corner; `null` beside the
   * picture, and without one.
   */
  toPicture(x: number, y: number): PicturePoint | null {
    const box = this.#controller.pictureBox;
    return box && pointAt(this.view, box, { x, y });
  }

  /**
   * The position, in pixels from the element's top left corner, of a point of the picture, 0 to 1; `null` without a
   * picture. It is outside of the element where the view does not show the point.
   */
  toElement(x: number, y: number): PicturePoint | null {
    const box = this.#controller.pictureBox;
    return box && positionOf(this.view, box, { x, y });
  }

  /** Whether animations are paused: the fire, the video of `light-src`, the wandering torch. */
  get paused(): boolean {
    return this.#controller.isPaused;
  }

  /** Starts the animations, even if the visitor prefers reduced motion. */
  play(): void {
    this.#controller.isPaused = false;
  }

  /** Pauses the animations. */
  pause(): void {
    this.#controller.isPaused = true;
  }

  /**
   * The light that a script sets: the name of a built-in one; its options `name`, `x`, `y`, `size`, `color`; or a source
   * that replaces it; `null`, the default, follows the attributes. Until a source has a picture, and while it fails, the
   * last light stays. The element follows the frames of videos and streams while it is in the viewport. A WebGL canvas
   * needs `preserveDrawingBuffer`, because the element reads it after its frame has ended.
   */
  get light(): LightValue {
    return this.#state.pageLight;
  }
  set light(value: LightValue) {
    const light = value ?? null;
    const { activeSource } = this.#state.light;
    if (activeSource !== null && light === activeSource) this.lightChanged();
    else this.#controller.setLight(light);
  }

  /** Reads the source in `light` again in the next frame. Canvases, `ImageData` and numbers do not report changes. */
  lightChanged(): void {
    if (this.#state.light.activeSource) this.#session.redraw();
  }

  /** Returns light and view to the attributes and to the `light` of the script. */
  reset(): void {
    this.#controller.reset();
  }

  /** Light and view as a short text that is safe in an address. It does not contain what a source shows. */
  getState({ prefix }: StateOptions = {}): string {
    this.#controller.readOptions();
    return this.#state.share(prefix);
  }

  /** Restores a text of `getState`, of this or another element. Missing values follow the attributes. */
  setState(text: string, { prefix }: StateOptions = {}): void {
    const controller = this.#controller;
    controller.reset();
    controller.readOptions();
    for (const error of this.#state.restore(text, prefix)) controller.warn(error);
  }

  /** Removes the poster as soon as there is a picture. */
  dismissPoster(): void {
    this.#controller.dismissPoster();
  }

  /**
   * Lets the torch follow the device's orientation until `reset`. Resolves to whether it is allowed. Some browsers
   * ask the visitor, so call it in a click handler.
   */
  requestTilt(): Promise<boolean> {
    return this.#controller.requestTilt();
  }

  /** The backend in use; `null` if there is none. */
  get activeBackend(): Backend | null {
    return this.#session.backend;
  }

  /**
   * The share of the photograph's components in the current picture, the most important ones first: 1, or less while
   * the file is loading and while the picture changes faster than it can be drawn in full. `null` without a picture.
   */
  get quality(): number | null {
    return this.#session.quality;
  }

  /** The SIMD level or the graphics adapter of the backend. */
  get kernel(): string | null {
    return this.#session.renderer?.kernel ?? null;
  }

  /** Facts about the photograph; `null` until it is decoded. */
  get info(): PhotoInfo | null {
    return this.#session.photo?.info ?? null;
  }

  /**
   * Draws the current picture in full quality and encodes it; `scale` multiplies its width and height, up to 4. Rejects
   * with `not-loaded` if there is no photograph, or if another one replaces it meanwhile.
   */
  async toBlob({ type = 'image/png', quality, scale = 1 }: ToBlobOptions = {}): Promise<Blob> {
    if (!(scale > 0 && scale <= MAX_SCALE)) {
      throw new RangeError(`scale must be more than 0 and at most ${MAX_SCALE}`);
    }
    // Nothing may be awaited in between: the canvas of a GPU keeps its content only until the next frame.
    return encodePicture(await this.#controller.renderNow(), type, quality, scale);
  }

  connectedCallback(): void {
    this.#controller.schedule();
    // Properties that were set before the element was defined hide the accessors of this class.
    for (const name of [...PROPERTIES, 'light', 'torch', 'view', 'photograph'] as const) {
      if (Object.hasOwn(this, name)) {
        const value = this[name];
        delete (this as Record<string, unknown>)[name];
        Object.assign(this, { [name]: value });
      }
    }
  }

  disconnectedCallback(): void {
    // Scheduled, because an element that is moved within the document is connected again at once.
    this.#controller.schedule();
  }

  attributeChangedCallback(name: string): void {
    this.#controller.attributeChanged(name);
  }
}

/** The reflected properties, and listeners with the types of the element's own events. */
export interface RelightablePhotoElement extends ReflectedProperties {
  addEventListener<K extends keyof RelightablePhotoEventMap>(
    type: K,
    listener: (this: RelightablePhotoElement, event: RelightablePhotoEventMap[K]) => unknown,
    options?: boolean | AddEventListenerOptions,
  ): void;
  addEventListener(
    type: string,
    listener: EventListenerOrEventListenerObject,
    options?: boolean | AddEventListenerOptions,
  ): void;
  removeEventListener<K extends keyof RelightablePhotoEventMap>(
    type: K,
    listener: (this: RelightablePhotoElement, event: RelightablePhotoEventMap[K]) => unknown,
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
    'relightable-photo': RelightablePhotoElement;
  }
}
