/** Loads a photograph: fetches a file and decodes it while it arrives. */

import type { LoadOptions } from '../photo/load-options.js';
import type { PhotoDecoder } from '../photo/photo-decoder.js';
import type { LoadedPhotograph } from '../photo/photograph.js';
import { endSentence, hasCode, PhotoError, toPhotoError } from '../shared/errors.js';
import { linkedController, withTimeout } from '../shared/promises.js';
import type { ByteRange } from '../shared/value-types.js';
import { fileName, tooLong } from './http-errors.js';
import { type FetchedPiece, HttpSource } from './http-source.js';

export interface LoadPorts {
  readonly createDecoder: () => Promise<PhotoDecoder>;
  readonly fetch: typeof fetch;
  /** Milliseconds, from any start. */
  readonly now: () => number;
  /** Lets the page draw and handle input. */
  readonly yieldToPage: () => Promise<void>;
}

/** The first request. It contains the index of most files, and small files as a whole. */
const FIRST_RANGE: ByteRange = { start: 0, end: 1 << 14 };
const MIN_PREVIEW_INTERVAL_MS = 400;

/**
 * Loads a photograph; starts once more if the file is replaced meanwhile. Throws a `PhotoError`, or the signal's reason
 * if it is aborted; nothing remains allocated then.
 */
export async function openPhoto(url: string, options: LoadOptions, ports: LoadPorts) {
  try {
    return await open(url, options, ports);
  } catch (thrown) {
    if (!hasCode(thrown, 'http-changed')) throw thrown;
    // A cache may still have parts of the old file.
    const reload: typeof fetch = (input, init) => ports.fetch(input, { ...init, cache: 'reload' });
    return await open(url, options, { ...ports, fetch: reload });
  }
}

async function open(
  url: string,
  options: LoadOptions,
  ports: LoadPorts,
): Promise<LoadedPhotograph> {
  const { signal, onWaiting } = options;
  signal.throwIfAborted();
  const stop = linkedController(signal);
  onWaiting(true);
  try {
    const source = new HttpSource(url, { fetch: ports.fetch });
    const firstPieces = source.read(FIRST_RANGE, stop.signal);
    // The decoder starts while the server answers.
    const starting = ports.createDecoder();
    stop.signal.addEventListener('abort', () => {
      starting.then((decoder) => decoder.free()).catch(() => {});
    });
    const [decoder, first] = await Promise.all([
      withTimeout(starting, { signal: stop.signal }),
      firstPieces.next().finally(() => onWaiting(false)),
    ]);
    const pieces = piecesFor(decoder, source, first, firstPieces, stop.signal);
    return await decodePieces(decoder, reportWaits(pieces, onWaiting), options, ports);
  } catch (thrown) {
    signal.throwIfAborted();
    throw withFileName(toPhotoError(thrown), url);
  } finally {
    // Ends the transfer and frees the decoder.
    stop.abort();
  }
}

function withFileName(error: PhotoError, url: string): PhotoError {
  const { code, message, cause } = error;
  if (!code.startsWith('format-') || message.includes(fileName(url))) return error;
  return new PhotoError(code, endSentence(`${fileName(url)}: ${message}`), cause);
}

/** The pieces of the first request, and then those that the decoder asks for. */
async function* piecesFor(
  decoder: PhotoDecoder,
  source: HttpSource,
  first: IteratorResult<FetchedPiece, void>,
  firstPieces: AsyncIterable<FetchedPiece>,
  signal: AbortSignal,
): AsyncGenerator<FetchedPiece, void> {
  if (!first.done) yield first.value;
  yield* firstPieces;
  let lastBytesFed = -1;
  for (;;) {
    const { fileBytes: end, next, bytesFed } = decoder.state;
    const { size } = source;
    if (end !== undefined && size !== undefined && size > end) throw tooLong(source.url, end, size);
    if (!next) return;
    // Otherwise the loop would never end.
    if (bytesFed === lastBytesFed)
      throw new Error('the decoder asks for bytes that it already has');
    lastBytesFed = bytesFed;
    yield* source.read(next, signal);
  }
}

async function* reportWaits(
  pieces: AsyncIterable<FetchedPiece>,
  onWaiting: LoadOptions['onWaiting'],
): AsyncGenerator<FetchedPiece, void> {
  onWaiting(true);
  for await (const piece of pieces) {
    onWaiting(false);
    yield piece;
    onWaiting(true);
  }
  onWaiting(false);
}

/** Decodes pieces of a file in the order in which they arrive. The caller frees the decoder. */
export async function decodePieces(
  decoder: PhotoDecoder,
  pieces: AsyncIterable<FetchedPiece>,
  options: Omit<LoadOptions, 'onWaiting'>,
  ports: Pick<LoadPorts, 'now' | 'yieldToPage'>,
): Promise<LoadedPhotograph> {
  const { signal, onProgress } = options;
  let reported = 0;
  const nextPreview = previewsOf(decoder, ports.now);
  const reportProgress = () => {
    const { bytesFed, fileBytes } = decoder.state;
    if (bytesFed > reported) onProgress(bytesFed, fileBytes ?? 0);
    reported = bytesFed;
  };
  const yieldToPage = async () => {
    reportProgress();
    await ports.yieldToPage();
    signal.throwIfAborted();
  };
  for await (const { offset, bytes } of pieces) {
    signal.throwIfAborted();
    await decoder.feed(offset, bytes, yieldToPage);
    signal.throwIfAborted();
    reportProgress();
    signal.throwIfAborted();
    const preview = options.onPreview ? await nextPreview() : null;
    const { onPreview } = options;
    if (signal.aborted || !onPreview) preview?.free();
    else if (preview) onPreview(preview);
    signal.throwIfAborted();
  }
  const photo = await decoder.finish();
  if (signal.aborted) photo.free();
  signal.throwIfAborted();
  return photo;
}

/**
 * Makes previews: the first as soon as possible, and each further one when twice as many bytes have arrived. A preview
 * takes as long as decoding the bytes so far, so that all of them together take as long as the photograph. None is made
 * once the whole file is there.
 */
function previewsOf(
  decoder: PhotoDecoder,
  now: () => number,
): () => Promise<LoadedPhotograph | null> {
  let lastScans = 0;
  let lastBytes = 0;
  let lastMs = Number.NEGATIVE_INFINITY;
  return async () => {
    const { scansDone, bytesFed, next } = decoder.state;
    if (scansDone <= lastScans || bytesFed < 2 * lastBytes || !next) return null;
    if (now() - lastMs < MIN_PREVIEW_INTERVAL_MS) return null;
    lastScans = scansDone;
    lastBytes = bytesFed;
    const preview = await decoder.preview();
    lastMs = now();
    return preview;
  };
}
