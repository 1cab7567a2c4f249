/** Makes the pictures of a page linear, in the worker. */

import type { CaptureReaderModule, LinearPng } from '../engine/capture-reader-exports.js';
import type { RecoveryModule } from '../engine/recovery-exports.js';
import { PhotoError } from '../shared/errors.js';
import { pageFiles } from './page-files.js';
import type { PictureSize, PicturesHeader, SentPicture } from './protocol.js';

/** 8-bit codes, linear; 255 is saturated. */
const SRGB = Float32Array.from({ length: 256 }, (_, code) => {
  if (code === 255) return Number.NaN;
  const value = code / 255;
  return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
});

/** Linear values, row by row. */
interface LinearValues extends PictureSize {
  readonly data: Float32Array;
}

type ReaderSettings = Pick<PicturesHeader, 'lightGamma' | 'black' | 'white'>;

export class PictureReader {
  readonly #emission: Float32Array;

  /** `loadReader` is called for PNGs only. */
  constructor(
    { emissionOfCodes }: Pick<RecoveryModule, 'emissionOfCodes'>,
    private readonly loadReader: () => Promise<CaptureReaderModule>,
    private readonly settings: ReaderSettings,
  ) {
    this.#emission = emissionOfCodes(settings.lightGamma);
  }

  /** Three values for each pixel. `name` is the picture's name in messages. */
  async photograph(picture: SentPicture, name: string, size: PictureSize): Promise<Float32Array> {
    const { black, white } = this.settings;
    const decode = async (file: Blob) => {
      const reader = await this.loadReader();
      return reader.readPhotograph(pageFiles(new Map([[name, file]])), name, black, white);
    };
    const linear = await toLinear(picture, SRGB, decode);
    return checkSize(linear, name, size, [3]);
  }

  /** One or three values for each light element: one if the channels of its codes are equal. */
  async pattern(picture: SentPicture, name: string, size: PictureSize): Promise<Float32Array> {
    const { lightGamma } = this.settings;
    const decode = async (file: Blob) => {
      const reader = await this.loadReader();
      return reader.readPattern(pageFiles(new Map([[name, file]])), name, lightGamma);
    };
    const linear = await toLinear(picture, this.#emission, decode);
    const data = checkSize(linear, name, size, [1, 3]);
    return isGrey(data, size) ? data.filter((_, i) => i % 3 === 0) : data;
  }

  /** As `pattern`, with three values for each light element. */
  async light(picture: SentPicture, name: string, size: PictureSize): Promise<Float32Array> {
    const data = await this.pattern(picture, name, size);
    if (data.length !== size.width * size.height) return data;
    return Float32Array.from({ length: 3 * data.length }, (_, i) => data[Math.floor(i / 3)] ?? 0);
  }
}

async function toLinear(
  picture: SentPicture,
  table: Float32Array,
  decode: (file: Blob) => Promise<LinearPng>,
): Promise<LinearValues> {
  if (picture instanceof Blob) {
    const png = await decode(picture);
    const { width, height, data } = png;
    png.free();
    return { width, height, data };
  }
  if (!('data' in picture)) return fromCodes(readBitmap(picture), table);
  const { width, height, data } = picture;
  if (data instanceof Float32Array) return { width, height, data };
  return fromCodes({ width, height, data }, table);
}

function fromCodes(
  { width, height, data: codes }: Pick<ImageData, 'width' | 'height' | 'data'>,
  table: Float32Array,
): LinearValues {
  const data = new Float32Array(3 * width * height);
  for (let from = 0, to = 0; to < data.length; from += 4, to += 3) {
    for (let c = 0; c < 3; c += 1) data[to + c] = table[codes[from + c] as number] as number;
  }
  return { width, height, data };
}

function readBitmap(bitmap: ImageBitmap): ImageData {
  const { width, height } = bitmap;
  const context = new OffscreenCanvas(width, height).getContext('2d');
  if (!context) throw new PhotoError('internal', 'The browser has no 2D canvas in workers.');
  context.drawImage(bitmap, 0, 0);
  bitmap.close();
  return context.getImageData(0, 0, width, height);
}

function checkSize(
  { width, height, data }: LinearValues,
  name: string,
  size: PictureSize,
  channels: readonly number[],
): Float32Array {
  if (width !== size.width || height !== size.height) {
    const message = `${name} is ${width}x${height}, others are ${size.width}x${size.height}; all must have one size`;
    throw new PhotoError('capture-size', message);
  }
  if (channels.some((count) => data.length === count * width * height)) return data;
  const each = channels.join(' or ');
  const message = `${name} has ${data.length} values for ${width}x${height} pixels; give ${each} for each`;
  throw new PhotoError('capture-size', message);
}

function isGrey(data: Float32Array, { width, height }: PictureSize): boolean {
  if (data.length === width * height) return false;
  for (let i = 0; i < data.length; i += 3) {
    if (data[i] !== data[i + 1] || data[i] !== data[i + 2]) return false;
  }
  return true;
}
