/** Relights a photograph with the CPU on the calling thread. */

import { loadCpu } from '../engine/core-modules.js';
import { createOutputTransform } from '../engine/output-settings.js';
import type { CpuModule, ImportedPhoto, Light } from '../engine/wasm-exports.js';
import { cameraLightConverter } from '../lights/camera-light.js';
import { toPhotoError } from '../shared/errors.js';
import type { Gamut, LightName, ToneCurve } from '../shared/keywords.js';
import {
  parseExposure,
  parseGamut,
  parseLight,
  parseNumber,
  parseTone,
  parseWhiteBalance,
} from '../shared/setting-parsers.js';
import type { CorePhotograph } from './core-photograph.js';
import { LtmPhotograph } from './decoded-photo.js';
import { fetchCoreWasm } from './wasm-provider.js';

/** A torch behind a point of the picture: (0, 0) is the top left corner and (1, 1) the bottom right corner. */
export interface Torch {
  readonly x: number;
  readonly y: number;
  /** Its radius in units of the light plane's shorter side. */
  readonly size?: number;
}

/**
 * A light image of any size, row by row: linear red, green and blue from 0 to 1 in a `Float32Array`, or sRGB codes with
 * alpha as in `ImageData`. Alpha scales the pixel's light.
 */
export interface LightImage {
  readonly data: Float32Array | Uint8ClampedArray;
  readonly width: number;
  readonly height: number;
}

/** A light: the name of a built-in one, a torch or a light image. */
export type LightDescriptor = LightName | Torch | LightImage;

/** Options of `relight`. */
export interface RelightOptions {
  /** Factor on the picture's brightness. */
  readonly exposure?: number;
  /** Factors on red, green and blue. */
  readonly whiteBalance?: readonly [red: number, green: number, blue: number];
  /** How brightness above white is shown: `clip` cuts it off, `filmic` compresses it. */
  readonly tone?: ToneCurve;
  /** The colour space of the pixels. */
  readonly gamut?: Gamut;
  /** The share of the components to use, the most important first: 0 to 1. */
  readonly quality?: number;
}

/** A picture for `new ImageData`. */
export interface RelitPicture {
  readonly width: number;
  readonly height: number;
  /** RGBA, row by row. */
  readonly pixels: Uint8ClampedArray<ArrayBuffer>;
}

/** Rejects with a `PhotoError`: `attribute` for an invalid option, `light-…` for an invalid light. */
export async function relight(
  photo: CorePhotograph,
  light: LightDescriptor = 'flood',
  options: RelightOptions = {},
): Promise<RelitPicture> {
  if (!(photo instanceof LtmPhotograph)) {
    throw new TypeError('relight takes a photograph from decode');
  }
  const { exposure = 1, whiteBalance = [1, 1, 1], tone, gamut } = options;
  const quality = parseNumber(String(options.quality ?? 1), 'quality', 0, 1, 'it is a share') ?? 1;
  const output = {
    exposure: parseExposure(String(exposure)),
    whiteBalance: parseWhiteBalance(whiteBalance.join(' ')),
    tone: parseTone(tone ?? null),
  };
  const outputGamut = parseGamut(gamut ?? null);
  const { width, height } = photo;
  const pixels = new Uint8ClampedArray(4 * width * height);
  const module = await loadCpu(fetchCoreWasm);
  try {
    await photo.photograph.withModule(module, (modulePhoto) => {
      photo.relighter ??= new module.RowRangeRelighter(modulePhoto, 0, height);
      const { relighter } = photo;
      const convert = cameraLightConverter(module, modulePhoto, photo.photograph);
      const lightInModule = convert(createLight(module, modulePhoto, light));
      const transform = createOutputTransform(
        module,
        output,
        photo.photograph.colorMatrix,
        outputGamut,
      );
      try {
        const [first = 0, end = 0] = relighter.lightRows;
        const out = new Uint8Array(pixels.buffer);
        relighter.relight(lightInModule.linearRgb(first, end), transform, quality, out);
      } finally {
        transform.free();
        lightInModule.free();
      }
    });
  } catch (thrown) {
    throw toPhotoError(thrown);
  }
  return { width, height, pixels };
}

function createLight(
  { Light }: CpuModule,
  modulePhoto: ImportedPhoto,
  light: LightDescriptor,
): Light {
  if (typeof light === 'string') return Light.builtin(modulePhoto, parseLight(light));
  if ('x' in light) {
    const [u = 0, v = 0] = modulePhoto.behind(light.x, light.y);
    return Light.torch(modulePhoto, u, v, light.size);
  }
  const { data, width, height } = light;
  if (data instanceof Float32Array) return Light.fromLinear(modulePhoto, data, width, height);
  return Light.fromSrgb(modulePhoto, data, width, height);
}
