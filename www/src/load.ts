/** From an address to a decoded photograph. */

import type { Decoder, Engine, Photo } from './engine.js';
import { PhotoError, toPhotoError } from './errors.js';
import { body, checkHead, request, short } from './http.js';

/** Told how much of the file has come; `total` is 0 until known. */
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

/** Bytes decoded in one go: some tiles, a few milliseconds. */
const SLICE_BYTES = 1 << 18;
/** Time after which the page gets its turn: within a frame of 60 a second, with room for its own
 * work. */
const TURN_MS = 8;

/**
 * Fetches and decodes a file while it arrives. Throws a `PhotoError`, or the signal's reason once
 * aborted; what was decoded till then is freed.
 */
export async function openPhoto(
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
    // The module is compiled while the server thinks.
    const [engine, response] = await Promise.all([
      ports.engine(),
      request(url, stop.signal, ports.fetch),
    ]);
    signal.throwIfAborted();
    return await decode(new engine.Decoder(), url, response, signal, onProgress, ports);
  } catch (thrown) {
    // A transfer that nobody waits for any more is not left running.
    stop.abort();
    signal.throwIfAborted();
    throw toPhotoError(thrown);
  } finally {
    signal.removeEventListener('abort', stopToo);
  }
}

async function decode(
  decoder: Decoder,
  url: string,
  response: Response,
  signal: AbortSignal,
  onProgress: OnProgress,
  ports: LoadPorts,
): Promise<Photo> {
  const promised = checkHead(url, response).bytes;
  let held = true;
  let turn = ports.now();
  try {
    for await (const piece of body(url, response, signal, () => decoder.fileBytes)) {
      for (let at = 0; at < piece.byteLength; at += SLICE_BYTES) {
        decoder.feed(piece.subarray(at, at + SLICE_BYTES));
        if (ports.now() - turn >= TURN_MS) {
          await ports.pause();
          signal.throwIfAborted();
          turn = ports.now();
        }
      }
      onProgress(decoder.bytesFed, decoder.fileBytes ?? 0);
      signal.throwIfAborted();
    }
    const { bytesFed, fileBytes } = decoder;
    held = false;
    try {
      return decoder.finish();
    } catch (thrown) {
      const error = toPhotoError(thrown);
      // Only a server that sent all it promised has a file that is short. Of others it cannot be
      // told whether the file or the transfer ended early; the latter is likelier, and curable.
      const allCame = promised !== undefined && bytesFed >= promised;
      if (error.code === 'format-truncated' && !allCame) {
        throw short(url, bytesFed, fileBytes ?? promised, thrown);
      }
      throw error;
    }
  } finally {
    if (held) decoder.free();
  }
}

/** A `PhotoError` for an element without an address. */
export function missingSource(): PhotoError {
  return new PhotoError('src-missing', 'There is no photograph to show: src is not set.');
}
