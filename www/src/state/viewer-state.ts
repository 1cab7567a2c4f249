/** The viewer's state: light, view and animation, as the options request them until a visitor changes them. */

import type { OutputSettings } from '../engine/output-settings.js';
import { multiplyRgb, parseLightColor } from '../lights/light-color.js';
import type { PhotoError } from '../shared/errors.js';
import type { LightName } from '../shared/keywords.js';
import { reuse } from '../shared/reuse-if-equal.js';
import { CENTRE, clampToPicture } from '../shared/value-types.js';
import { PARSERS } from './attribute-parsers.js';
import { type LightOverrides, LightState, type LightStateListener } from './light-state.js';
import type { ElementOptions } from './options.js';
import { RevealState } from './reveal.js';
import { formatState, parseState } from './share-link.js';
import { clampView, FULL_VIEW, type ZoomView } from './viewport.js';

/** A built-in light for `setLight`. Absent fields keep their values. */
export interface SetLightOptions {
  readonly name?: LightName;
  /** The torch's position, 0 to 1 across the picture. */
  readonly x?: number;
  /** The torch's position, 0 to 1 down the picture. */
  readonly y?: number;
  /** The torch's radius, as a fraction of the light plane's shorter side. */
  readonly size?: number;
  /** Any CSS colour. */
  readonly color?: string;
}

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

  /** A change of an attribute takes precedence over an earlier override. */
  clearOverride(attribute: string): void {
    const key = OVERRIDE_OF_ATTRIBUTE[attribute];
    if (key) this.light.override({ [key]: null });
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

  /** @throws {TypeError | PhotoError} for an invalid field, before anything changes */
  setLight({ name, x, y, size, color }: SetLightOptions): void {
    const overrides: { -readonly [K in keyof LightOverrides]?: LightOverrides[K] } = {};
    if (name !== undefined) overrides.name = PARSERS.light(name);
    if (x !== undefined || y !== undefined) {
      const last = this.light.torch ?? CENTRE;
      const torch = { x: x ?? last.x, y: y ?? last.y };
      if (!(Number.isFinite(torch.x) && Number.isFinite(torch.y))) {
        throw new TypeError('x and y must be finite numbers, from 0 to 1');
      }
      overrides.torch = clampToPicture(torch);
    }
    if (size !== undefined) overrides.size = PARSERS['light-size'](String(size));
    if (color !== undefined) overrides.color = parseLightColor(color);
    this.light.override(overrides);
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

  get sharedState(): string {
    const { item, torch, size, color } = this.light;
    const { exposure } = this.output;
    const isTorch = item === 'torch';
    return formatState({
      light: item === 'projection' ? null : item,
      torch: isTorch ? torch : null,
      size: isTorch ? size : null,
      color: color?.hex ?? null,
      exposure: exposure === 1 ? null : exposure,
      view: this.#view,
    });
  }

  /** Restores the state of a share link. Returns an error for each invalid value. */
  restore(text: string): readonly PhotoError[] {
    const { state, errors } = parseState(text);
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
