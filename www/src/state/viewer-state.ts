/**
 * What visitors have before them: light, view, and whether things move by themselves. As the page asks for
 * it, until somebody chooses something else. Knows no DOM.
 */

import type { OutputSettings } from '../engine/output-settings.js';
import { type CssColorParser, multiplyRgb, parseLightColor } from '../lights/light-color.js';
import type { PhotoError } from '../shared/errors.js';
import type { LightName } from '../shared/names.js';
import { parseLight } from '../shared/parse-settings.js';
import { CENTRE, clampToPicture } from '../shared/values.js';
import { parseTorchSize } from './attribute-values.js';
import { type LightChoice, type LightItem, Lighting, type LightingListener } from './lighting.js';
import type { Asked } from './options.js';
import { Curtain } from './reveal.js';
import { readState, writeState } from './share-state.js';
import { clampView, type PhotoView, sameView, WHOLE } from './viewport.js';

/** What `setLight` takes of a light. What is left out stays. */
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

/** Attributes that take the place of what was chosen. */
const OVERRULES: Readonly<Record<string, keyof LightChoice>> = {
  light: 'name',
  'light-src': 'name',
  'light-x': 'torch',
  'light-y': 'torch',
  'light-size': 'size',
  'light-color': 'color',
};

/** See the module. */
export class Exhibit {
  readonly lighting: Lighting;
  readonly curtain = new Curtain();
  readonly #readColor: CssColorParser;
  #asked: Asked;
  #view = WHOLE;
  #exposure: number | null = null;
  #paused: boolean | null = null;
  /** Why there is no picture. */
  fault: string | null = null;

  constructor(asked: Asked, listener: LightingListener, readColor: CssColorParser) {
    this.#asked = asked;
    this.lighting = new Lighting(listener);
    this.#readColor = readColor;
  }

  /** What the page asks for by attributes. */
  get asked(): Asked {
    return this.#asked;
  }
  set asked(asked: Asked) {
    this.#asked = asked;
    this.lighting.ask(asked.light, asked.crossOrigin);
    this.view = this.#view;
  }

  /** An attribute was written: what was chosen in its place goes. */
  overrule(attribute: string): void {
    const key = OVERRULES[attribute];
    if (key) this.lighting.choose({ [key]: null });
  }

  /** The part of the picture that is shown: no more of it, and no closer than allowed. */
  get view(): PhotoView {
    return this.#view;
  }
  set view(view: PhotoView) {
    const next = clampView(view, this.#asked.zoom);
    if (!sameView(next, this.#view)) this.#view = next;
  }

  /** Whether what moves by itself stands still; `null` where nobody has said. */
  get paused(): boolean | null {
    return this.#paused;
  }
  set paused(paused: boolean | null) {
    this.#paused = paused;
  }

  /** Whether there is a picture to be seen and touched. */
  get shown(): boolean {
    return this.fault === null && !this.curtain.isDown(this.#asked);
  }

  get output(): OutputSettings {
    const { exposure, whiteBalance, tone } = this.#asked;
    const { color } = this.lighting;
    return {
      exposure: this.#exposure ?? exposure,
      whiteBalance: color ? multiplyRgb(whiteBalance, color.factors) : whiteBalance,
      tone,
    };
  }

  /** Throws where there is no such light. */
  pose({ name, x, y, size, color }: LightPose): void {
    const from = this.lighting.torch ?? CENTRE;
    const choice: { -readonly [K in keyof LightChoice]?: LightChoice[K] } = {};
    if (name !== undefined) choice.name = parseLight(name);
    if (x !== undefined || y !== undefined) {
      const torch = { x: x ?? from.x, y: y ?? from.y };
      if (!(Number.isFinite(torch.x) && Number.isFinite(torch.y))) {
        throw new TypeError('x and y must be finite numbers, from 0 to 1');
      }
      choice.torch = clampToPicture(torch);
    }
    if (size !== undefined) choice.size = parseTorchSize(String(size));
    if (color !== undefined) choice.color = parseLightColor(color, this.#readColor);
    this.lighting.choose(choice);
  }

  /** The light so many farther in the list. */
  step(by: number): LightItem {
    const { items, item } = this.lighting;
    const next = items.at((items.indexOf(item) + by) % items.length) ?? item;
    this.lighting.item = next;
    return next;
  }

  /** As the page asks. */
  reset(): void {
    this.lighting.reset();
    this.#view = WHOLE;
    this.#exposure = null;
    this.#paused = null;
  }

  get state(): string {
    const { item, torch, size, color } = this.lighting;
    const { exposure } = this.output;
    return writeState({
      light: item === 'projection' ? null : item,
      torch: item === 'torch' ? torch : null,
      size: item === 'torch' ? size : null,
      color: color?.hex ?? null,
      exposure: exposure === 1 ? null : exposure,
      view: this.#view,
    });
  }

  /** Takes a state. Gives what is wrong with it. */
  take(text: string): readonly PhotoError[] {
    const { state, faults } = readState(text);
    const { light: name, torch, size, color, exposure, view } = state;
    this.reset();
    this.lighting.choose({
      name,
      torch: torch && clampToPicture(torch),
      size,
      color: parseLightColor(color, this.#readColor),
    });
    this.#exposure = exposure;
    this.view = view;
    return faults;
  }
}
