/** The viewer's state: light, view and animation, as the options request them until a visitor changes them. */

import type { OutputSettings } from '../engine/output-settings.js';
import { multiplyRgb, parseLightColor } from '../lights/light-color.js';
import type { PhotoError } from '../shared/errors.js';
import { reuse } from '../shared/reuse-if-equal.js';
import { clampToPicture } from '../shared/value-types.js';
import { LightState, type LightStateListener } from './light-state.js';
import type { ElementOptions } from './options.js';
import { type LightOverrides, type LightValue, parsePageLight } from './page-light.js';
import { RevealState } from './reveal.js';
import { formatState, parseState } from './share-link.js';
import { clampView, FULL_VIEW, type ZoomView } from './viewport.js';

/** The override that a change of an attribute clears. */
const OVERRIDE_OF_ATTRIBUTE: Readonly<Record<string, keyof LightOverrides>> = {
  light: 'name',
  'light-src': 'name',
  'light-x': 'torch',
  'light-y': 'torch',
  'light-size': 'size',
  'light-color': 'color',
};

export class ViewerState {
  readonly light: LightState;
  readonly reveal = new RevealState();
  #options: ElementOptions;
  #view = FULL_VIEW;
  #output: OutputSettings | null = null;
  #exposure: number | null = null;
  #pageLight: LightValue = null;
  /** Whether animations are paused; `null` until a visitor or a script decides. */
  paused: boolean | null = null;
  /** Why there is no picture. */
  errorMessage: string | null = null;

  constructor(options: ElementOptions, listener: LightStateListener) {
    this.#options = options;
    this.light = new LightState(listener);
  }

  get options(): ElementOptions {
    return this.#options;
  }
  set options(options: ElementOptions) {
    this.#options = options;
    this.light.setOptions(options.light);
    this.view = this.#view;
  }

  /** A change of an attribute takes precedence over earlier choices of the script and the visitor. */
  clearOverride(attribute: string): void {
    const key = OVERRIDE_OF_ATTRIBUTE[attribute];
    if (key) this.light.clear(key);
    if (key === 'name') this.#pageLight = null;
  }

  /** The same object as last time, unless the view has changed. The setter clamps. */
  get view(): ZoomView {
    return this.#view;
  }
  set view(view: ZoomView) {
    this.#view = reuse(this.#view, clampView(view, this.#options.maxZoom));
  }

  /** Whether visitors see the picture and can interact with it. */
  get isPictureShown(): boolean {
    return this.errorMessage === null && !this.reveal.isPosterShown(this.#options);
  }

  /** The same object as last time, unless a field has changed. */
  get output(): OutputSettings {
    const { exposure, whiteBalance, tone } = this.#options;
    const { color } = this.light;
    const last = this.#output;
    const factors = color ? multiplyRgb(whiteBalance, color.factors) : whiteBalance;
    this.#output = reuse(last, {
      exposure: this.#exposure ?? exposure,
      whiteBalance: reuse(last?.whiteBalance, factors),
      tone,
    });
    return this.#output;
  }

  /** The light that the page's script has set; `null` for that of the attributes. */
  get pageLight(): LightValue {
    return this.#pageLight;
  }
  /** @throws {TypeError | PhotoError} for an invalid value, before anything changes */
  set pageLight(value: LightValue) {
    this.light.page = parsePageLight(value, this.light.options);
    this.#pageLight = value;
  }

  /** Selects another item of the light menu, `by` items away. */
  selectNextLight(by: 1 | -1): void {
    const { items, item } = this.light;
    this.light.item = items.at((items.indexOf(item) + by) % items.length) ?? item;
  }

  reset(): void {
    this.light.reset();
    this.#view = FULL_VIEW;
    this.#exposure = null;
    this.paused = null;
  }

  /** The state for a share link. */
  share(prefix?: string): string {
    const { item, torch, size, color } = this.light;
    const { exposure } = this.output;
    const isTorch = item === 'torch';
    const state = {
      light: item === 'projection' ? null : item,
      torch: isTorch ? torch : null,
      size: isTorch ? size : null,
      color: color?.hex ?? null,
      exposure: exposure === 1 ? null : exposure,
      view: this.#view,
    };
    return formatState(state, prefix);
  }

  /** Restores the state of a share link. Returns an error for each invalid value. */
  restore(text: string, prefix?: string): readonly PhotoError[] {
    const { state, errors } = parseState(text, prefix);
    const { light: name, torch, size, color, exposure, view } = state;
    this.reset();
    this.light.override({
      name,
      torch: torch && clampToPicture(torch),
      size,
      color: parseLightColor(color),
    });
    this.#exposure = exposure;
    this.view = view;
    return errors;
  }
}
