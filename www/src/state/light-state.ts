/**
 * The light. A visitor's choice takes precedence over the page's script, and that over the options. A change of an option
 * takes precedence over both; `reset` clears the visitor's choice. The script for sources is fetched when one is used for the first time.
 */

import type * as SourceSupport from '../lights/image-light-entry.js';
import type { LightColor } from '../lights/light-color.js';
import type { LightMedia } from '../lights/light-media.js';
import { type LightSetting, PENDING_IMAGE } from '../lights/light-setting.js';
import type { LightSource } from '../lights/light-source.js';
import type { LightSourceListener, LightSourceObserver } from '../lights/light-source-observer.js';
import { missingScript, type PhotoError } from '../shared/errors.js';
import { LIGHTS, type LightName } from '../shared/keywords.js';
import { reuse } from '../shared/reuse-if-equal.js';
import { clampToPicture, type PicturePoint } from '../shared/value-types.js';
import type { LightAttributes } from './options.js';
import { type LightOverrides, NO_OVERRIDES, NO_PAGE_LIGHT, type PageLight } from './page-light.js';

export interface LightStateListener extends LightSourceListener {
  /** The support for sources has been fetched: call `setOptions` again. */
  loaded(): void;
}

/** An item of the light menu: a built-in light, or the page's source. */
export type LightMenuItem = LightName | 'projection';

const DEFAULTS: LightAttributes = { ...NO_OVERRIDES, name: 'flood', src: null, crossOrigin: null };
const FIRE_FRAME_SECONDS = 1 / 30;
/** Frames of a 30 Hz screen arrive a little early at times. */
const FIRE_TOLERANCE_SECONDS = 0.004;

export class LightState {
  #support: typeof SourceSupport | null = null;
  #fetching: Promise<void> | null = null;
  /** Why the support could not be fetched. */
  #fetchError: PhotoError | null = null;
  #options = DEFAULTS;
  #page: PageLight = NO_PAGE_LIGHT;
  #overrides = NO_OVERRIDES;
  #media: LightMedia | null = null;
  #observer: LightSourceObserver | null = null;
  #setting: LightSetting | null = null;
  #isVisible = false;
  #isPlaying = false;
  /** Seconds since the fire was lit: now, in the last frame, and in the next frame. */
  #fireSeconds = 0;
  #fireFrame = 0;
  #nextFireFrame = FIRE_FRAME_SECONDS;

  constructor(
    private readonly listener: LightStateListener,
    private readonly fetchSupport = (): Promise<typeof SourceSupport> =>
      import('../lights/image-light-entry.js'),
  ) {}

  setOptions(options: LightAttributes): void {
    // Another source is a reason to try the fetch again.
    if (options.src !== this.#options.src) this.#fetchError = null;
    this.#options = options;
    this.#update();
  }

  get options(): LightAttributes {
    return this.#options;
  }

  /** The light that the page's script has set. It replaces a visitor's choice. */
  set page(light: PageLight) {
    const { name, source, torch, size, color } = light;
    this.#page = light;
    this.#fetchError = null;
    const isReset = !(name || source || torch || size || color);
    this.override({
      name: null,
      ...((isReset || torch) && { torch: null }),
      ...((isReset || size) && { size: null }),
      ...((isReset || color) && { color: null }),
    });
  }

  /** The source that replaces the built-in lights now; that of `light-src` only once it is supported. */
  get activeSource(): LightSource | null {
    return this.#usesSource ? (this.#page.source ?? this.#media?.source ?? null) : null;
  }

  get #usesSource(): boolean {
    return this.#overrides.name === null && this.#hasSource;
  }

  get #hasSource(): boolean {
    const { source, name } = this.#page;
    return source !== null || (name === null && this.#options.src !== null);
  }

  #get<K extends keyof LightOverrides>(key: K): LightAttributes[K] {
    return this.#overrides[key] ?? this.#page[key] ?? this.#options[key];
  }

  /** The built-in light, or the one that the source replaces. */
  get name(): LightName {
    return this.#get('name');
  }

  /** `null` behind the centre of the picture. */
  get torch(): PicturePoint | null {
    return this.#get('torch');
  }
  set torch(torch: PicturePoint | null) {
    const point = torch && reuse(this.#overrides.torch, clampToPicture(torch));
    this.#overrides = { ...this.#overrides, torch: point };
  }

  get size(): number | null {
    return this.#get('size');
  }

  get color(): LightColor | null {
    return this.#get('color');
  }

  get overrides(): LightOverrides {
    return this.#overrides;
  }

  override(overrides: Partial<LightOverrides>): void {
    this.#overrides = { ...this.#overrides, ...overrides };
    this.#update();
  }

  /** The option of this field has changed: it takes precedence over earlier choices. */
  clear(key: keyof LightOverrides): void {
    this.#page = key === 'name' ? NO_PAGE_LIGHT : { ...this.#page, [key]: null };
    this.override({ [key]: null });
  }

  reset(): void {
    this.override(NO_OVERRIDES);
  }

  get items(): readonly LightMenuItem[] {
    return this.#hasSource ? ['projection', ...LIGHTS] : LIGHTS;
  }

  get item(): LightMenuItem {
    return this.#usesSource ? 'projection' : this.name;
  }
  set item(item: LightMenuItem) {
    this.override({ name: item === 'projection' ? null : item });
  }

  get isTorch(): boolean {
    return this.item === 'torch';
  }

  get isFire(): boolean {
    return this.item === 'fire';
  }

  /** Whether the light can play: a fire, or the video of `light-src`. */
  get isPlayable(): boolean {
    return this.isFire || (this.#media?.isVideo === true && this.#usesMedia);
  }

  get #usesMedia(): boolean {
    return this.#media !== null && this.activeSource === this.#media.source;
  }

  /** Advances the fire. Whether it has a new frame, at most 30 times a second. */
  advanceFire(seconds: number): boolean {
    this.#fireSeconds += seconds;
    if (this.#fireSeconds < this.#nextFireFrame - FIRE_TOLERANCE_SECONDS) return false;
    this.#fireFrame = this.#fireSeconds;
    const earliest = Math.max(this.#nextFireFrame, this.#fireSeconds - FIRE_FRAME_SECONDS);
    this.#nextFireFrame = earliest + FIRE_FRAME_SECONDS;
    return true;
  }

  /** The same object as last time, unless a field has changed. */
  get setting(): LightSetting {
    const { name, size } = this;
    const isTorch = name === 'torch';
    this.#setting = reuse(this.#setting, {
      name,
      torch: isTorch ? this.torch : null,
      image: this.#usesSource ? (this.#observer?.image ?? PENDING_IMAGE) : null,
      ...(isTorch && size !== null && { size }),
      ...(name === 'fire' && { seconds: this.#fireFrame }),
    });
    return this.#setting;
  }

  /** Settles when the fetch of the support for the active source has ended; `null` if none is in progress. */
  get pendingSource(): Promise<void> | null {
    return this.#usesSource ? this.#fetching : null;
  }

  /** Why the active source has no picture. */
  get error(): PhotoError | null {
    return this.#observer?.error ?? (this.#usesSource ? this.#fetchError : null);
  }

  /** Observes sources while the element is visible, and plays the video of `light-src` if `isPlaying`. */
  observe(isVisible: boolean, isPlaying: boolean): void {
    this.#isVisible = isVisible;
    this.#isPlaying = isPlaying;
    this.#updateObserver();
  }

  #update(): void {
    const support = this.#support;
    if (this.#hasSource && !support && !this.#fetchError) this.#fetching ??= this.#fetch();
    const { src, crossOrigin } = this.#options;
    if (this.#media?.address !== src || this.#media?.crossOrigin !== crossOrigin) {
      this.#media?.release();
      this.#media = support && src !== null ? new support.LightMedia(src, crossOrigin) : null;
    }
    const source = this.activeSource;
    if (source !== (this.#observer?.source ?? null)) {
      this.#observer?.stop();
      this.#observer =
        source && support ? new support.LightSourceObserver(source, this.listener) : null;
    }
    this.#updateObserver();
  }

  async #fetch(): Promise<void> {
    try {
      this.#support = await this.fetchSupport();
    } catch (cause) {
      this.#fetchError = missingScript('light-source', 'images as light', cause);
    }
    this.#fetching = null;
    if (!this.#fetchError) this.listener.loaded();
    else if (this.#usesSource) this.listener.errorChanged(this.#fetchError);
  }

  #updateObserver(): void {
    if (this.#isVisible) this.#observer?.start();
    else this.#observer?.stop();
    if (this.#media) this.#media.playing = this.#isPlaying && this.#isVisible && this.#usesMedia;
  }
}
