/** Decodes a file from any source on the calling thread. */

import { loadDecoder } from '../engine/core-modules.js';
import type { FetchedPiece } from '../loading/http-source.js';
import { decodePieces, openPhoto } from '../loading/load.js';
import { createMainThreadDecoder } from '../photo/main-thread-decoder.js';
import { PhotoError, toPhotoError } from '../shared/errors.js';
import type { CorePhotograph } from './core-photograph.js';
import { LtmPhotograph } from './decoded-photo.js';
import { fetchCoreWasm, readFile } from './wasm-provider.js';

/** A `.ltm` file: its bytes, a stream of them, or its address, which may be relative in a page and `file:` in Node. */
export type DecodeInput =
  | string
  | URL
  | ArrayBuffer
  | ArrayBufferView
  | Blob
  | ReadableStream<Uint8Array>
  | AsyncIterable<Uint8Array>;

/** Options of `decode`. */
export interface DecodeOptions {
  /** Cancels decoding when it is aborted. */
  readonly signal?: AbortSignal;
  /** Gets the number of decoded bytes and that of the file, which is 0 until known. */
  readonly onProgress?: (loaded: number, total: number) => void;
}

/**
 * Decodes a photograph on this thread, and gives way to other tasks every few milliseconds. Rejects with a
 * `PhotoError`, or with the signal's reason if it is aborted.
 */
export async function decode(
  file: DecodeInput,
  { signal = new AbortController().signal, onProgress = () => {} }: DecodeOptions = {},
): Promise<CorePhotograph> {
  signal.throwIfAborted();
  const now = () => performance.now();
  const createDecoder = async () => createMainThreadDecoder(await loadDecoder(fetchCoreWasm), now);
  const options = { signal, onProgress, onPreview: null, onWaiting: () => {} };
  if (typeof file !== 'string' && !(file instanceof URL)) {
    const arriving = arrivingBytes(file);
    const decoder = await createDecoder();
    try {
      const pieces = piecesOf(arriving);
      const photograph = await decodePieces(decoder, pieces, options, { now, yieldToPage });
      return new LtmPhotograph(photograph);
    } catch (thrown) {
      signal.throwIfAborted();
      throw toPhotoError(thrown);
    } finally {
      decoder.free();
    }
  }
  const url = absoluteUrl(file);
  const bytes = await readFile(url).catch((cause: unknown) => {
    throw new PhotoError('http-status', `${url} could not be read: ${String(cause)}`, cause);
  });
  if (bytes) return decode(bytes, { signal, onProgress });
  const fetchFile: typeof fetch = (...request) => fetch(...request);
  const ports = { createDecoder, fetch: fetchFile, yieldToPage, now };
  return new LtmPhotograph(await openPhoto(url, options, ports));
}

async function* piecesOf(
  arriving: Iterable<Uint8Array> | AsyncIterable<Uint8Array>,
): AsyncGenerator<FetchedPiece, void> {
  let offset = 0;
  for await (const bytes of arriving) {
    yield { offset, bytes };
    offset += bytes.byteLength;
  }
}

function arrivingBytes(file: Exclude<DecodeInput, string | URL>) {
  if (file instanceof ArrayBuffer) return [new Uint8Array(file)];
  if (ArrayBuffer.isView(file)) {
    return [new Uint8Array(file.buffer, file.byteOffset, file.byteLength)];
  }
  if (file instanceof Blob) return iterate(file.stream());
  if ('getReader' in file) return iterate(file);
  if (file && Symbol.asyncIterator in file) return file;
  throw new TypeError(
    'decode takes an address, an ArrayBuffer, a view of one, a Blob, a ReadableStream or an ' +
      'AsyncIterable of Uint8Array',
  );
}

/** `ReadableStream` is not iterable in every browser. */
async function* iterate(stream: ReadableStream<Uint8Array>): AsyncGenerator<Uint8Array, void> {
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

function absoluteUrl(file: string | URL): string {
  try {
    return new URL(file, globalThis.location?.href).href;
  } catch (cause) {
    const remedy = 'Outside of a page, use an absolute URL with https: or file:.';
    throw new PhotoError('src-missing', `“${file}” is not a URL. ${remedy}`, cause);
  }
}

function yieldToPage(): Promise<void> {
  return new Promise((resolve) => setTimeout(resolve));
}
