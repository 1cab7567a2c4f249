/** From an address to a decoded photograph. */

import type { PhotoDecoder } from '../photo/main-thread-decoder.js';
import type { Photograph } from '../photo/photograph.js';
import { sentence } from '../player/backends.js';
import type { ByteRange } from '../shared/byte-range.js';
import { hasCode, PhotoError, toPhotoError } from '../shared/errors.js';
import { HttpSource, type Piece } from './byte-source.js';
import { nameOf, tooLong } from './http-errors.js';
import { within } from './retry.js';

/** Told how much of the file has been decoded; `total` is 0 until known. A file that is replaced
 * meanwhile counts anew. */
export type OnProgress = (loaded: number, total: number) => void;

/** Given coarser photographs while the file comes, each to be freed by who takes it. */
export type OnPreview = (photograph: Photograph) => void;

/** What loading needs from the world around it. */
export interface LoadPorts {
  readonly decoder: () => Promise<PhotoDecoder>;
  readonly fetch: typeof fetch;
  /** Milliseconds since any moment. */
  readonly now: () => number;
  /** Lets the page draw and take input. */
  readonly pause: () => Promise<void>;
}

/** What decoders want first. Of most files the head is in it, and small ones are as a whole. */
const FIRST: ByteRange = { start: 0, end: 1 << 14 };
/** A coarser photograph is worth its trouble where more time than this has passed since the last. */
const PREVIEW_MS = 400;

/**
 * Fetches and decodes a file while it arrives. One that is replaced meanwhile is begun anew, once.
 * Throws a `PhotoError`, or the signal's reason once aborted; what was decoded till then is freed.
 */
export async function openPhoto(
  url: string,
  signal: AbortSignal,
  onProgress: OnProgress,
  onPreview: OnPreview | null,
  ports: LoadPorts,
): Promise<Photograph> {
  try {
    return await open(url, signal, onProgress, onPreview, ports);
  } catch (thrown) {
    if (!hasCode(thrown, 'http-changed')) throw thrown;
    // A cache may still have parts of the file that was.
    const anew: typeof fetch = (input, init) => ports.fetch(input, { ...init, cache: 'reload' });
    return await open(url, signal, onProgress, onPreview, { ...ports, fetch: anew });
  }
}

async function open(
  url: string,
  signal: AbortSignal,
  onProgress: OnProgress,
  onPreview: OnPreview | null,
  ports: LoadPorts,
): Promise<Photograph> {
  const stop = new AbortController();
  const stopToo = () => stop.abort(signal.reason);
  signal.throwIfAborted();
  signal.addEventListener('abort', stopToo);
  try {
    const source = new HttpSource(url, { fetch: ports.fetch });
    const opening = source.read(FIRST, stop.signal);
    // The decoder gets ready while the server thinks.
    const starting = ports.decoder();
    stop.signal.addEventListener('abort', () => {
      // What a worker is at need not be waited for. One that nobody waits for is let go when it comes.
      starting.then((decoder) => decoder.free()).catch(() => {});
    });
    const [decoder, first] = await Promise.all([within(starting, stop.signal), opening.next()]);
    const pieces = piecesOf(first, opening, decoder, source, stop.signal);
    return await decode(decoder, pieces, signal, onProgress, onPreview, ports);
  } catch (thrown) {
    signal.throwIfAborted();
    throw named(toPhotoError(thrown), url);
  } finally {
    signal.removeEventListener('abort', stopToo);
    // Neither a transfer nor a decoder is left running.
    stop.abort();
  }
}

/** What a decoder says is wrong, of the file that it is wrong with. */
function named(error: PhotoError, url: string): PhotoError {
  const { code, message, cause } = error;
  if (!code.startsWith('format-') || message.includes(nameOf(url))) return error;
  return new PhotoError(code, sentence(`${nameOf(url)}: ${message}`), cause);
}

/** All of a file that its decoder wants, after what was asked for without it. */
async function* piecesOf(
  first: IteratorResult<Piece, void>,
  opening: AsyncIterable<Piece>,
  decoder: PhotoDecoder,
  source: HttpSource,
  signal: AbortSignal,
): AsyncGenerator<Piece, void> {
  if (!first.done) yield first.value;
  yield* opening;
  let fed = -1;
  for (;;) {
    const { fileBytes: end, next, bytesFed } = decoder.state;
    const { size } = source;
    if (end !== undefined && size !== undefined && size > end) throw tooLong(source.url, end, size);
    if (!next) return;
    // It would be asked for again and again.
    if (bytesFed === fed) throw new Error('the decoder wants what it has been fed');
    fed = bytesFed;
    yield* source.read(next, signal);
  }
}

async function decode(
  decoder: PhotoDecoder,
  pieces: AsyncIterable<Piece>,
  signal: AbortSignal,
  onProgress: OnProgress,
  onPreview: OnPreview | null,
  ports: LoadPorts,
): Promise<Photograph> {
  let told = 0;
  const nextPreview = previewsOf(decoder, ports.now);
  const tell = () => {
    const { bytesFed, fileBytes } = decoder.state;
    if (bytesFed > told) onProgress(bytesFed, fileBytes ?? 0);
    told = bytesFed;
  };
  const turn = async () => {
    tell();
    await ports.pause();
    signal.throwIfAborted();
  };
  for await (const { offset, bytes } of pieces) {
    signal.throwIfAborted();
    await decoder.feed(offset, bytes, turn);
    signal.throwIfAborted();
    tell();
    signal.throwIfAborted();
    const preview = onPreview ? await nextPreview() : null;
    if (signal.aborted) preview?.free();
    else if (preview) onPreview?.(preview);
    signal.throwIfAborted();
  }
  const photo = await decoder.finish();
  if (signal.aborted) photo.free();
  signal.throwIfAborted();
  return photo;
}

/**
 * Makes coarser photographs of what has come: the first as soon as there is one. Each takes as long as
 * decoding what has come, so that the next is of twice as much, and none is made that the whole photograph
 * would soon take the place of.
 */
function previewsOf(decoder: PhotoDecoder, now: () => number): () => Promise<Photograph | null> {
  let scans = 0;
  let bytes = 0;
  let at = Number.NEGATIVE_INFINITY;
  return async () => {
    const { scansDone, bytesFed, next } = decoder.state;
    if (scansDone <= scans || bytesFed < 2 * bytes || !next) return null;
    if (now() - at < PREVIEW_MS) return null;
    scans = scansDone;
    bytes = bytesFed;
    const preview = await decoder.preview();
    at = now();
    return preview;
  };
}

/** A `PhotoError` for an element without an address. */
export function missingSource(): PhotoError {
  return new PhotoError('src-missing', 'There is no photograph to show: src is not set.');
}
