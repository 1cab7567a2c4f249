/**
 * What shines: as the page asks by attributes and `lightSource`, until a visitor or `setLight` chooses
 * something else. What was chosen goes with `reset`, and where the page asks for something new.
 */

import { PENDING_IMAGE } from '../lights/image-light.js';
import type { LightColor } from '../lights/light-color.js';
import type { CrossOrigin, LightMedia } from '../lights/light-media.js';
import type { LightSetting } from '../lights/light-setting.js';
import type { LightSource } from '../lights/light-source.js';
import type { LightSourceObserver } from '../lights/light-source-observer.js';
import type * as Sources from '../lights/light-sources.js';
import { messageOf, PhotoError } from '../shared/errors.js';
import { LIGHTS, type LightName } from '../shared/names.js';
import { reuse } from '../shared/reuse.js';
import { clampToPicture, type PicturePoint } from '../shared/values.js';
import type { AskedLight } from './options.js';

/** Takes the place of what the page asks for; what is `null` does not. */
export interface LightChoice {
  /** A built-in light, also in place of a source. */
  readonly name: LightName | null;
  readonly torch: PicturePoint | null;
  readonly size: number | null;
  readonly color: LightColor | null;
}

/** What is told. */
export interface LightingListener {
  /** What a source shows is another. */
  changed(): void;
  /** Sources can be followed from now on: `ask` again, unless nobody is there any more. */
  came(): void;
  errorChanged(fault: PhotoError | null): void;
}

/** One of the lights that there are to choose from: what the page shines, or a built-in one. */
export type LightItem = LightName | 'projection';

/** The script that follows sources. Fetched where there is one. */
const fetchSources = (): Promise<typeof Sources> => import('../lights/light-sources.js');

const PAGE: LightChoice = { name: null, torch: null, size: null, color: null };
const NONE: AskedLight = { name: 'flood', src: null, place: null, size: null, color: null };
/** Of the fire, in seconds: 30 pictures in one. */
const FIRE_PERIOD = 1 / 30;
/** Screens that show no more do not keep time to the thousandth. */
const FIRE_SLACK = 0.004;

/** See the module. */
export class Lighting {
  readonly #listener: LightingListener;
  readonly #fetchSources: () => Promise<typeof Sources>;
  /** Once it is there; `undefined` while nobody has asked for it, or it could not be had. */
  #sources: typeof Sources | null | undefined;
  /** Settles when it is, or is not. */
  #coming: Promise<void> | null = null;
  /** Why it could not. */
  #missing: PhotoError | null = null;
  #asked: AskedLight = NONE;
  #choice: LightChoice = PAGE;
  #crossOrigin: CrossOrigin = null;
  #media: LightMedia | null = null;
  #source: LightSource | null = null;
  #follower: LightSourceObserver | null = null;
  #setting: LightSetting | null = null;
  #watched = false;
  #plays = false;
  /** How long the fire has burnt, as it is shown, and when it is to be shown next. */
  #fire = 0;
  #fireShown = 0;
  #fireDue = FIRE_PERIOD;

  constructor(listener: LightingListener, sources = fetchSources) {
    this.#listener = listener;
    this.#fetchSources = sources;
  }

  /** Takes what the page asks for by attributes. */
  ask(asked: AskedLight, crossOrigin: CrossOrigin): void {
    // One that could not be had is tried again where something else is asked.
    if (asked.src !== this.#asked.src) this.#missing = null;
    this.#asked = asked;
    this.#crossOrigin = crossOrigin;
    this.#update();
  }

  /** What the page's script has put in the light's place. */
  get source(): LightSource | null {
    return this.#source;
  }
  set source(source: LightSource | null) {
    this.#source = source;
    this.#missing = null;
    this.#choice = { ...this.#choice, name: null };
    this.#update();
  }

  /** What shines in the built-in lights' place; that of `light-src` once it is followed. */
  get shining(): LightSource | null {
    return this.#projects ? (this.#source ?? this.#media?.source ?? null) : null;
  }

  /** Whether a source is to shine, in the built-in lights' place. */
  get #projects(): boolean {
    return this.#choice.name === null && this.#hasSource;
  }

  get #hasSource(): boolean {
    return this.#source !== null || this.#asked.src !== null;
  }

  /** The built-in light that shines, or that a source stands in for. */
  get name(): LightName {
    return this.#choice.name ?? this.#asked.name;
  }

  /** Where a torch shines; `null` over the middle of the light. */
  get torch(): PicturePoint | null {
    return this.#choice.torch ?? this.#asked.place;
  }
  set torch(torch: PicturePoint | null) {
    this.#choice = { ...this.#choice, torch: torch && clampToPicture(torch) };
  }

  get size(): number | null {
    return this.#choice.size ?? this.#asked.size;
  }

  get color(): LightColor | null {
    return this.#choice.color ?? this.#asked.color;
  }

  /** Takes the place of what the page asks for, as far as it says something. */
  choose(choice: Partial<LightChoice>): void {
    this.#choice = { ...this.#choice, ...choice };
    this.#update();
  }

  /** As the page asks. */
  reset(): void {
    this.#choice = PAGE;
    this.#update();
  }

  /** All that there are to choose from. */
  get items(): readonly LightItem[] {
    return this.#hasSource ? ['projection', ...LIGHTS] : LIGHTS;
  }

  get item(): LightItem {
    return this.#projects ? 'projection' : this.name;
  }
  set item(item: LightItem) {
    this.choose({ name: item === 'projection' ? null : item });
  }

  /** Whether a torch can be taken along. */
  get holdsTorch(): boolean {
    return !this.#projects && this.name === 'torch';
  }

  /** Whether fire burns. */
  get burns(): boolean {
    return !this.#projects && this.name === 'fire';
  }

  /** Whether something shines that can play: fire, or the page's own film. */
  get canPlay(): boolean {
    return this.burns || (this.#media?.isVideo === true && this.shining === this.#media.source);
  }

  /** Lets fire burn on. Gives whether it looks different: no more than 30 times a second. */
  burn(seconds: number): boolean {
    this.#fire += seconds;
    if (this.#fire < this.#fireDue - FIRE_SLACK) return false;
    this.#fireShown = this.#fire;
    this.#fireDue = Math.max(this.#fireDue, this.#fire - FIRE_PERIOD) + FIRE_PERIOD;
    return true;
  }

  get setting(): LightSetting {
    const { name, size } = this;
    const torch = name === 'torch' ? this.torch : null;
    const image = this.#projects ? (this.#follower?.image ?? PENDING_IMAGE) : null;
    this.#setting = reuse(this.#setting, {
      name,
      torch,
      image,
      ...(name === 'torch' && size !== null && { size }),
      ...(name === 'fire' && { seconds: this.#fireShown }),
    });
    return this.#setting;
  }

  /** Settles once sources are followed, or cannot be; `null` where nothing is waited for. */
  get coming(): Promise<void> | null {
    return this.#sources === null && this.#projects ? this.#coming : null;
  }

  /** Why nothing is to be seen of a source. */
  get fault(): PhotoError | null {
    return this.#follower?.error ?? (this.#projects ? this.#missing : null);
  }

  /** Keeps up with sources while anyone looks. `plays`: whether films may. */
  follow(watched: boolean, plays: boolean): void {
    this.#watched = watched;
    this.#plays = plays;
    this.#attend();
  }

  #update(): void {
    const sources = this.#sources;
    if (this.#hasSource && sources === undefined && !this.#missing) this.#coming = this.#fetch();
    const { src } = this.#asked;
    const media = this.#media;
    if (media && (media.address !== src || media.crossOrigin !== this.#crossOrigin)) {
      media.release();
      this.#media = null;
    }
    if (sources && src !== null) this.#media ??= new sources.LightMedia(src, this.#crossOrigin);
    const source = this.shining;
    if (source !== (this.#follower?.source ?? null) || !sources) {
      this.#follower?.stop();
      this.#follower =
        source && sources ? new sources.LightSourceObserver(source, this.#listener) : null;
    }
    this.#attend();
  }

  async #fetch(): Promise<void> {
    this.#sources = null;
    try {
      this.#sources = await this.#fetchSources();
    } catch (cause) {
      this.#sources = undefined;
      const message =
        `The script that lights by pictures could not be loaded (${messageOf(cause)}). It has to lie ` +
        "beside the element's.";
      this.#missing = new PhotoError('light-source', message, cause);
      if (this.#projects) this.#listener.errorChanged(this.#missing);
      return;
    }
    this.#listener.came();
  }

  #attend(): void {
    if (this.#watched) this.#follower?.start();
    else this.#follower?.stop();
    if (this.#media) {
      this.#media.playing = this.#plays && this.#watched && this.shining === this.#media.source;
    }
  }
}
