/** From a file, wherever it is, to a photograph in memory. */

import { loadDecoder } from '../engine/decoder-module.js';
import { tooLong } from '../loading/http-errors.js';
import { openPhoto } from '../loading/load.js';
import { MainThreadDecoder, type PhotoDecoder } from '../photo/main-thread-decoder.js';
import type { Photograph } from '../photo/photograph.js';
import { PhotoError, toPhotoError } from '../shared/errors.js';
import { DecodedPhotograph } from './decoded-photo.js';
import { coreCode, readFile } from './wasm-code.js';

/**
 * A `.ltm` file: its bytes, whole or as they come from its start on, or its address. That may be relative
 * where there is a page, and a `file:` URL in Node.
 */
export type PhotoFile =
  | string
  | URL
  | ArrayBuffer
  | ArrayBufferView
  | Blob
  | ReadableStream<Uint8Array>
  | AsyncIterable<Uint8Array>;

/** Options of `decode`. */
export interface DecodeOptions {
  /** Ends it; what was decoded till then is freed. */
  readonly signal?: AbortSignal;
  /** Told how many bytes have been decoded, and how many there are: 0 until known. */
  readonly onProgress?: (loaded: number, total: number) => void;
}

/** A photograph in memory, until freed. */
export interface CorePhotograph {
  /** Picture, in pixels. */
  readonly width: number;
  readonly height: number;
  /** Light plane, in elements. */
  readonly lightWidth: number;
  readonly lightHeight: number;
  /** Memory its light transport takes, in bytes. */
  readonly decodedBytes: number;
  /** What the file says of itself. */
  readonly metadata: unknown;
  /** Gives its memory back. */
  free(): void;
}

/**
 * Decodes a photograph, on this thread, in turns of some milliseconds. Rejects with a `PhotoError`, or with
 * the signal's reason once aborted.
 */
export async function decode(
  file: PhotoFile,
  { signal = new AbortController().signal, onProgress = () => {} }: DecodeOptions = {},
): Promise<CorePhotograph> {
  signal.throwIfAborted();
  const decoder = async () =>
    new MainThreadDecoder(await loadDecoder(coreCode), () => performance.now());
  if (typeof file !== 'string' && !(file instanceof URL)) {
    const taken = take(await decoder(), piecesOf(file), signal, onProgress);
    return new DecodedPhotograph(await taken);
  }
  const url = addressOf(file);
  const bytes = url.startsWith('file:') ? await bytesOf(url) : null;
  if (bytes) return decode(bytes, { signal, onProgress });
  const ports = { decoder, fetch: (...request: Parameters<typeof fetch>) => fetch(...request) };
  const now = () => performance.now();
  const photograph = openPhoto(url, signal, onProgress, null, { ...ports, pause, now });
  return new DecodedPhotograph(await photograph);
}

/** Decodes what comes, from its start on. */
async function take(
  decoder: PhotoDecoder,
  pieces: Iterable<Uint8Array> | AsyncIterable<Uint8Array>,
  signal: AbortSignal,
  onProgress: (loaded: number, total: number) => void,
): Promise<Photograph> {
  const turn = async () => {
    await pause();
    signal.throwIfAborted();
  };
  try {
    let offset = 0;
    for await (const bytes of pieces) {
      signal.throwIfAborted();
      await decoder.feed(offset, bytes, turn);
      offset += bytes.byteLength;
      const { bytesFed, fileBytes } = decoder.state;
      if (fileBytes !== undefined && offset > fileBytes) {
        throw tooLong('The file', fileBytes, offset);
      }
      onProgress(bytesFed, fileBytes ?? 0);
      signal.throwIfAborted();
    }
    return await decoder.finish();
  } catch (thrown) {
    signal.throwIfAborted();
    throw toPhotoError(thrown);
  } finally {
    decoder.free();
  }
}

function piecesOf(
  file: Exclude<PhotoFile, string | URL>,
): Iterable<Uint8Array> | AsyncIterable<Uint8Array> {
  if (file instanceof ArrayBuffer) return [new Uint8Array(file)];
  if (ArrayBuffer.isView(file)) {
    return [new Uint8Array(file.buffer, file.byteOffset, file.byteLength)];
  }
  if (file instanceof Blob) return chunksOf(file.stream());
  if ('getReader' in file) return chunksOf(file);
  if (file && Symbol.asyncIterator in file) return file;
  throw new TypeError(
    'decode takes an address, an ArrayBuffer, a view of one, a Blob, a ReadableStream or an ' +
      'AsyncIterable of Uint8Array',
  );
}

/** Not every browser can iterate over streams. */
async function* chunksOf(stream: ReadableStream<Uint8Array>): AsyncGenerator<Uint8Array, void> {
  const reader = stream.getReader();
  try {
    for (;;) {
      const { done, value } = await reader.read();
      if (done) return;
      yield value;
    }
  } finally {
    void reader.cancel().catch(() => {});
  }
}

function addressOf(file: string | URL): string {
  try {
    return new URL(file, globalThis.location?.href).href;
  } catch (cause) {
    throw new PhotoError(
      'src-missing',
      `“${file}” is not an address. Without a page it has to be a whole one, with https: or file:.`,
      cause,
    );
  }
}

async function bytesOf(url: string): Promise<Uint8Array | null> {
  try {
    return await readFile(url);
  } catch (cause) {
    throw new PhotoError('http-status', `${url} could not be read: ${String(cause)}`, cause);
  }
}

/** Lets others have the thread. */
function pause(): Promise<void> {
  return new Promise((resolve) => setTimeout(resolve));
}
