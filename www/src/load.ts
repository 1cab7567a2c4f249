/** From an address to a decoded photograph. */

import type { Decoder, Engine, Photo } from './engine.js';
import { PhotoError, toPhotoError } from './errors.js';
import { tooLong } from './http-errors.js';
import { within } from './retry.js';
import { type ByteRange, HttpSource, type Piece, type SourceOptions } from './source.js';

/** Told how much of the file has been decoded; `total` is 0 until known. A file that is replaced
 * meanwhile counts anew. */
export type OnProgress = (loaded: number, total: number) => void;

/** What loading needs from the world around it. */
export interface LoadPorts {
  readonly engine: () => Promise<Pick<Engine, 'Decoder'>>;
  readonly fetch: typeof fetch;
  /** Lets the page draw and take input. */
  readonly pause: () => Promise<void>;
  /** Milliseconds, from any start. */
  readonly now: () => number;
}

/** What every file begins with. The source asks for more along with it: of most files, the head. */
const HEADER: ByteRange = { start: 0, end: 144 };
/** Decoders take a range in order, and all of a file is wanted: what is left comes as one answer. */
const IN_ORDER: Partial<SourceOptions> = {
  concurrency: 1,
  maxRangeBytes: Number.POSITIVE_INFINITY,
};
/** Bytes decoded in one go: so few that hardly two tiles end among them. */
const SLICE_BYTES = 1 << 10;
/** Time after which the page gets its turn: within a frame of 60 a second, with room for its own
 * work. */
const TURN_MS = 8;

/**
 * Fetches and decodes a file while it arrives. One that is replaced meanwhile is begun anew, once.
 * Throws a `PhotoError`, or the signal's reason once aborted; what was decoded till then is freed.
 */
export async function openPhoto(
  url: string,
  signal: AbortSignal,
  onProgress: OnProgress,
  ports: LoadPorts,
): Promise<Photo> {
  try {
    return await open(url, signal, onProgress, ports);
  } catch (thrown) {
    if (!(thrown instanceof PhotoError && thrown.code === 'http-changed')) throw thrown;
    // A cache may still have parts of the file that was.
    const anew: typeof fetch = (input, init) => ports.fetch(input, { ...init, cache: 'reload' });
    return await open(url, signal, onProgress, { ...ports, fetch: anew });
  }
}

async function open(
  url: string,
  signal: AbortSignal,
  onProgress: OnProgress,
  ports: LoadPorts,
): Promise<Photo> {
  const stop = new AbortController();
  const stopToo = () => stop.abort(signal.reason);
  signal.throwIfAborted();
  signal.addEventListener('abort', stopToo);
  try {
    const source = new HttpSource(url, { fetch: ports.fetch }, IN_ORDER);
    const opening = source.read([HEADER], stop.signal);
    // The module is compiled while the server thinks.
    const loading = within(ports.engine(), stop.signal);
    const [engine, first] = await Promise.all([loading, opening.next()]);
    signal.throwIfAborted();
    const decoder = new engine.Decoder();
    const pieces = piecesOf(first, opening, decoder, source, stop.signal);
    return await decode(decoder, pieces, signal, onProgress, ports);
  } catch (thrown) {
    // A transfer that nobody waits for any more is not left running.
    stop.abort();
    signal.throwIfAborted();
    throw toPhotoError(thrown);
  } finally {
    signal.removeEventListener('abort', stopToo);
  }
}

/** All of a file that its decoder wants, after what was asked for without it. */
async function* piecesOf(
  first: IteratorResult<Piece, void>,
  opening: AsyncIterable<Piece>,
  decoder: Decoder,
  source: HttpSource,
  signal: AbortSignal,
): AsyncGenerator<Piece, void> {
  if (!first.done) yield first.value;
  yield* opening;
  let fed = -1;
  for (;;) {
    const [end, size] = [decoder.fileBytes, source.size];
    if (end !== undefined && size !== undefined && size > end) throw tooLong(source.url, end, size);
    const wanted = rangesOf(decoder.wants());
    if (wanted.length === 0) return;
    // It would be asked for again and again.
    if (decoder.bytesFed === fed) throw new Error('the decoder wants what it has been fed');
    fed = decoder.bytesFed;
    yield* source.read(wanted, signal);
  }
}

async function decode(
  decoder: Decoder,
  pieces: AsyncIterable<Piece>,
  signal: AbortSignal,
  onProgress: OnProgress,
  ports: LoadPorts,
): Promise<Photo> {
  let held = true;
  let turn = ports.now();
  let told = 0;
  const tell = () => {
    if (decoder.bytesFed > told) onProgress(decoder.bytesFed, decoder.fileBytes ?? 0);
    told = decoder.bytesFed;
  };
  try {
    for await (const { offset, bytes } of pieces) {
      for (let at = 0; at < bytes.byteLength; at += SLICE_BYTES) {
        decoder.feed(offset + at, bytes.subarray(at, at + SLICE_BYTES));
        if (ports.now() - turn >= TURN_MS) {
          tell();
          await ports.pause();
          signal.throwIfAborted();
          turn = ports.now();
        }
      }
      tell();
      signal.throwIfAborted();
    }
    held = false;
    return decoder.finish();
  } finally {
    if (held) decoder.free();
  }
}

/** Ranges, of which `bounds` has where each begins and ends. */
function rangesOf(bounds: Float64Array): ByteRange[] {
  const ranges: ByteRange[] = [];
  for (let i = 0; i + 1 < bounds.length; i += 2) {
    ranges.push({ start: bounds[i] as number, end: bounds[i + 1] as number });
  }
  return ranges;
}

/** A `PhotoError` for an element without an address. */
export function missingSource(): PhotoError {
  return new PhotoError('src-missing', 'There is no photograph to show: src is not set.');
}
