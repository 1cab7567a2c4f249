/**
 * The light: as the options and `lightSource` request it, until a visitor or `setLight` overrides it. `reset` and a
 * change of an option clear overrides. The script for sources is fetched when one is used for the first time.
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

/** Values that take precedence over the options, and a name also over a source; `null` leaves an option in effect. */
export type LightOverrides = {
  readonly [K in 'name' | 'torch' | 'size' | 'color']: LightAttributes[K] | null;
};

export interface LightStateListener extends LightSourceListener {
  /** The support for sources has been fetched: call `setOptions` again. */
  loaded(): void;
}

/** An item of the light menu: a built-in light, or the page's source. */
export type LightMenuItem = LightName | 'projection';

const NO_OVERRIDES: LightOverrides = { name: null, torch: null, size: null, color: null };
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
  #overrides = NO_OVERRIDES;
  #media: LightMedia | null = null;
  #source: LightSource | null = null;
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

  /** The source that the page's script has set. */
  get source(): LightSource | null {
    return this.#source;
  }
  set source(source: LightSource | null) {
    this.#source = source;
    this.#fetchError = null;
    this.override({ name: null });
  }

  /** The source that replaces the built-in lights now; that of `light-src` only once it is supported. */
  get activeSource(): LightSource | null {
    return this.#usesSource ? (this.#source ?? this.#media?.source ?? null) : null;
  }

  get #usesSource(): boolean {
    return this.#overrides.name === null && this.#hasSource;
  }

  get #hasSource(): boolean {
    return this.#source !== null || this.#options.src !== null;
  }

  /** The built-in light, or the one that the source replaces. */
  get name(): LightName {
    return this.#overrides.name ?? this.#options.name;
  }

  /** `null` behind the centre of the picture. */
  get torch(): PicturePoint | null {
    return this.#overrides.torch ?? this.#options.torch;
  }
  set torch(torch: PicturePoint | null) {
    const point = torch && reuse(this.#overrides.torch, clampToPicture(torch));
    this.#overrides = { ...this.#overrides, torch: point };
  }

  get size(): number | null {
    return this.#overrides.size ?? this.#options.size;
  }

  get color(): LightColor | null {
    return this.#overrides.color ?? this.#options.color;
  }

  override(overrides: Partial<LightOverrides>): void {
    this.#overrides = { ...this.#overrides, ...overrides };
    this.#update();
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
