/** The pictures of a page in the form in which workers get them. */

import { messageOf, PhotoError } from '../shared/errors.js';
import type { PictureSize, SentPicture } from './protocol.js';
import type { PhotographInput } from './types.js';

/** Signature, then the header's length and name, width and height. */
const PNG_HEADER_BYTES = 24;
const PNG_SIGNATURE = 0x89504e47;

/** A PNG. */
type FileInput = Blob | ArrayBuffer | Uint8Array;

/** Nothing of it is copied yet. Rejects with `recover-options` if it is no picture. */
export async function toSentPicture(input: PhotographInput, name: string): Promise<SentPicture> {
  if (isFile(input)) return toFile(input);
  if (isCanvas(input)) {
    return createImageBitmap(input).catch((cause: unknown) => {
      const message = `${name} cannot be read: ${messageOf(cause)}.`;
      throw new PhotoError('recover-options', message, cause);
    });
  }
  if (typeof input === 'object' && input !== null && 'width' in input) {
    if (!('data' in input) || !(input.data instanceof Float32Array)) return input as ImageData;
    const { width, height, data } = input;
    return { width, height, data };
  }
  const message =
    `${name} is no picture; give ImageData, an ImageBitmap, a canvas, a 16-bit PNG as Blob or bytes, or linear values ` +
    'as { width, height, data }.';
  throw new PhotoError('recover-options', message);
}

/** The size of a picture; zero if it is a file that is no PNG, which the worker's decoder reports. */
export async function sizeOf(input: PhotographInput): Promise<PictureSize> {
  if (!isFile(input)) {
    const { width, height } = input;
    return { width, height };
  }
  const header = new DataView(await toFile(input).slice(0, PNG_HEADER_BYTES).arrayBuffer());
  if (header.byteLength < PNG_HEADER_BYTES || header.getUint32(0) !== PNG_SIGNATURE) {
    return { width: 0, height: 0 };
  }
  return { width: header.getUint32(16), height: header.getUint32(20) };
}

/** Whether the picture has 8-bit codes. */
export function hasCodes(input: PhotographInput): boolean {
  if (isFile(input)) return false;
  return !('data' in input) || !(input.data instanceof Float32Array);
}

/** Whether the picture is a PNG. */
export function isFile(input: PhotographInput): input is FileInput {
  return input instanceof Blob || input instanceof ArrayBuffer || input instanceof Uint8Array;
}

function toFile(input: FileInput): Blob {
  return input instanceof Blob ? input : new Blob([input as Uint8Array<ArrayBuffer>]);
}

function isCanvas(input: PhotographInput): input is HTMLCanvasElement | OffscreenCanvas {
  return typeof input === 'object' && input !== null && 'getContext' in input;
}
