/** Pictures of a photograph under any light, by the CPU, on this thread. */

import { loadCpu } from '../engine/cpu-module.js';
import { makeDisplay } from '../engine/output-settings.js';
import type { BandRelighter, CpuModule, DrawnPhoto, Light } from '../engine/types.js';
import { toPhotoError } from '../shared/errors.js';
import type { Gamut, LightName, ToneCurve } from '../shared/names.js';
import {
  parseExposure,
  parseGamut,
  parseLight,
  parseTone,
  parseWhiteBalance,
} from '../shared/parse-settings.js';
import type { CorePhotograph } from './decode.js';
import { DecodedPhotograph } from './decoded-photo.js';
import { coreCode } from './wasm-code.js';

/** A torch straight behind a point of the picture: 0, 0 is the top left corner and 1, 1 the bottom right. */
export interface Torch {
  readonly x: number;
  readonly y: number;
  /** Its radius, as a fraction of the light plane's shorter side. */
  readonly size?: number;
}

/**
 * A picture of light, of any size, row by row: linear red, green and blue in a `Float32Array`, 0 dark and 1
 * full brightness, or sRGB as `ImageData` has it, with alpha, which is the share of a pixel that shines.
 */
export interface PictureLight {
  readonly data: Float32Array | Uint8ClampedArray;
  readonly width: number;
  readonly height: number;
}

/** What may shine on a photograph. */
export type CoreLight = LightName | Torch | PictureLight;

/** Options of `relight`. */
export interface RelightOptions {
  /** Factor on the picture's brightness. */
  readonly exposure?: number;
  /** Factors on red, green and blue. */
  readonly whiteBalance?: readonly [red: number, green: number, blue: number];
  /** What becomes of brightness: `clip`, cut off at white, or `filmic`, rolled off before it. */
  readonly tone?: ToneCurve;
  /** What the pixels are codes of. */
  readonly gamut?: Gamut;
  /** The share of the photograph's components to draw by, the most important first: 0 to 1, which is all. */
  readonly detail?: number;
}

/** A picture in memory, as `ImageData` takes it. */
export interface Picture {
  readonly width: number;
  readonly height: number;
  /** RGBA, row by row. */
  readonly pixels: Uint8ClampedArray<ArrayBuffer>;
}

/** What relights each photograph, kept for the next picture. */
const relighters = new WeakMap<DecodedPhotograph, BandRelighter>();

/**
 * Draws a photograph under a light. Rejects with a `PhotoError`: `attribute` for options, `light-…` for
 * lights that cannot be had.
 */
export async function relight(
  photo: CorePhotograph,
  light: CoreLight = 'flood',
  options: RelightOptions = {},
): Promise<Picture> {
  if (!(photo instanceof DecodedPhotograph)) {
    throw new TypeError('relight takes what decode has given');
  }
  const { exposure = 1, whiteBalance = [1, 1, 1], tone, gamut, detail = 1 } = options;
  const output = {
    exposure: parseExposure(String(exposure)),
    whiteBalance: parseWhiteBalance(whiteBalance.join(' ')),
    tone: parseTone(tone ?? null),
  };
  const shown = parseGamut(gamut ?? null);
  const { width, height } = photo;
  const pixels = new Uint8ClampedArray(4 * width * height);
  const module = await loadCpu(coreCode);
  try {
    await photo.photograph.withModule(module, (inside) => {
      const relighter = relighterOf(module, photo, inside);
      const made = makeLight(module, inside, light);
      const display = makeDisplay(module, output, shown);
      try {
        const [first = 0, end = 0] = relighter.lightRows;
        const out = new Uint8Array(pixels.buffer);
        relighter.relight(made.linearRgb(first, end), display, detail, out);
      } finally {
        display.free();
        made.free();
      }
    });
  } catch (thrown) {
    throw toPhotoError(thrown);
  }
  return { width, height, pixels };
}

function relighterOf(
  module: CpuModule,
  photo: DecodedPhotograph,
  inside: DrawnPhoto,
): BandRelighter {
  const known = relighters.get(photo);
  if (known) return known;
  const made = new module.BandRelighter(inside, 0, photo.height);
  relighters.set(photo, made);
  photo.onFree = () => made.free();
  return made;
}

function makeLight({ Light }: CpuModule, inside: DrawnPhoto, light: CoreLight): Light {
  if (typeof light === 'string') return Light.builtin(inside, parseLight(light));
  if ('x' in light) return Light.torch(inside, light.x, light.y, light.size);
  const { data, width, height } = light;
  if (data instanceof Float32Array) return Light.fromLinear(inside, data, width, height);
  return Light.fromSrgb(inside, data, width, height);
}
