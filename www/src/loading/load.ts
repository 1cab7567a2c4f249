/** Loads a photograph: fetches a file and decodes it while it arrives. */

import type { LoadOptions } from '../photo/load-options.js';
import type { PhotoDecoder } from '../photo/photo-decoder.js';
import type { LoadedPhotograph, ShardRequest } from '../photo/photograph.js';
import { endSentence, hasCode, PhotoError, toPhotoError } from '../shared/errors.js';
import { linkedController, withTimeout } from '../shared/promises.js';
import type { ByteRange } from '../shared/value-types.js';
import { fileName, rangeIgnored, tooLong } from './http-errors.js';
import { type FetchedPiece, HttpSource } from './http-source.js';

export interface LoadPorts {
  readonly createDecoder: (maxTileBytes?: number) => Promise<PhotoDecoder>;
  readonly fetch: typeof fetch;
  /** Milliseconds, from any start. */
  readonly now: () => number;
  /** Lets the page draw and handle input. */
  readonly yieldToPage: () => Promise<void>;
}

/** Length of the first request. It contains the index of most files, and small files as a whole. */
const FIRST_BYTES = 1 << 14;
const MIN_PREVIEW_INTERVAL_MS = 400;

/**
 * Loads a photograph; starts once more if the file is replaced meanwhile. Throws a `PhotoError`, or the signal's reason
 * if it is aborted; nothing remains allocated then.
 */
export async function openPhoto(url: string, options: LoadOptions, ports: LoadPorts) {
  const openFrom = async (ports: LoadPorts) => {
    const photograph = await open(url, options, ports);
    const quiet = { onProgress: () => {}, onPreview: null, onWaiting: () => {} };
    photograph.openShard = (shard, signal) => open(url, { ...quiet, signal }, ports, shard);
    return photograph;
  };
  try {
    return await openFrom(ports);
  } catch (thrown) {
    if (!hasCode(thrown, 'http-changed')) throw thrown;
    // A cache may still have parts of the old file.
    const reload: typeof fetch = (input, init) => ports.fetch(input, { ...init, cache: 'reload' });
    return await openFrom({ ...ports, fetch: reload });
  }
}

/** Opens a shard, or the file, of which this is the last level. */
async function open(
  url: string,
  options: LoadOptions,
  ports: LoadPorts,
  shard?: ShardRequest,
): Promise<LoadedPhotograph> {
  const { signal, onWaiting } = options;
  signal.throwIfAborted();
  const stop = linkedController(signal);
  onWaiting(true);
  try {
    const source = new HttpSource(url, { fetch: ports.fetch });
    const start = shard?.bytes.start ?? 0;
    const end = Math.min(start + FIRST_BYTES, shard?.bytes.end ?? Number.POSITIVE_INFINITY);
    const firstPieces = source.read({ start, end }, stop.signal);
    // The decoder starts while the server answers.
    const starting = ports.createDecoder(shard?.maxTileBytes);
    stop.signal.addEventListener('abort', () => {
      starting.then((decoder) => decoder.free()).catch(() => {});
    });
    const [decoder, first] = await Promise.all([
      withTimeout(starting, { signal: stop.signal }),
      firstPieces.next().finally(() => onWaiting(false)),
    ]);
    const pieces = piecesFor(decoder, source, first, firstPieces, stop.signal, shard);
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
  shard: ShardRequest | undefined,
): AsyncGenerator<FetchedPiece, void> {
  const start = shard?.bytes.start ?? 0;
  const inShard = ({ offset, bytes }: FetchedPiece): FetchedPiece => {
    // The server sends the whole file.
    if (offset < start) throw rangeIgnored(source.url);
    return { offset: offset - start, bytes };
  };
  if (!first.done) yield inShard(first.value);
  for await (const piece of firstPieces) {
    yield inShard(piece);
    const { bytesOfLevels, fileBytes, next } = decoder.state;
    // The finer levels are fetched when they are seen.
    if (bytesOfLevels !== fileBytes && !next) return;
  }
  let lastBytesFed = -1;
  for (;;) {
    const { bytesOfLevels: end, next, bytesFed } = decoder.state;
    const { size } = source;
    if (!shard && end !== undefined && size !== undefined && size > end) {
      throw tooLong(source.url, end, size);
    }
    if (!next) return;
    // Otherwise the loop would never end.
    if (bytesFed === lastBytesFed)
      throw new Error('the decoder asks for bytes that it already has');
    lastBytesFed = bytesFed;
    const range = { start: start + next.start, end: start + next.end };
    const pieces = source.read(range, signal);
    if (shard) yield inShard(await join(pieces, range));
    else yield* pieces;
  }
}

/** The bytes of a range as one piece: decoding takes less memory then. */
async function join(pieces: AsyncIterable<FetchedPiece>, range: ByteRange): Promise<FetchedPiece> {
  const bytes = new Uint8Array(range.end - range.start);
  for await (const piece of pieces) bytes.set(piece.bytes, piece.offset - range.start);
  return { offset: range.start, bytes };
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
