/** Reading a file over HTTP as it arrives, with every way this can go wrong told apart. */

import { messageOf, PhotoError } from './errors.js';

/** What the answer's head says of the body to come. */
export interface Head {
  /**
   * Bytes of the body, as far as can be told. Not to be relied on: scripts may read Content-Length
   * of another origin's answer but not its Content-Encoding, so these may be compressed bytes.
   */
  readonly bytes: number | undefined;
}

/** Longest silence before a transfer is given up. Slow lines trickle; a line that is silent for
 * this long has been lost without either end being told. */
export const STALL_MS = 60_000;

/** Asks for a file. Throws `http-network`, `http-status` or `http-type`, or the abort's reason. */
export async function request(
  url: string,
  signal: AbortSignal,
  fetcher: typeof fetch = fetch,
  stallMs: number = STALL_MS,
): Promise<Response> {
  const response = await unlessStalled(fetcher(url, { signal }), url, stallMs).catch(
    (cause: unknown) => {
      signal.throwIfAborted();
      if (cause instanceof PhotoError) throw cause;
      throw new PhotoError(
        'http-network',
        `${nameOf(url)} could not be fetched: the server cannot be reached, or does not allow this ` +
          'page to read the file.',
        cause,
      );
    },
  );
  checkHead(url, response);
  return response;
}

/** Refuses an answer that is not the file. */
export function checkHead(url: string, response: Response): Head {
  if (!response.ok) {
    const status = `${response.status} ${response.statusText}`.trim();
    throw new PhotoError(
      'http-status',
      `${nameOf(url)} could not be loaded: the server answered ${status}.`,
    );
  }
  const type = response.headers.get('content-type')?.split(';', 1)[0]?.trim().toLowerCase();
  if (type === 'text/html' || type === 'application/xhtml+xml') {
    throw new PhotoError(
      'http-type',
      `${nameOf(url)} could not be loaded: the server sent a web page (${type}) in its place.`,
    );
  }
  // With Content-Encoding, Content-Length counts compressed bytes and the body comes decompressed.
  const encoding = response.headers.get('content-encoding');
  const length = response.headers.get('content-length');
  const plain = encoding === null || encoding === 'identity';
  return { bytes: plain && length !== null && /^\d+$/.test(length) ? Number(length) : undefined };
}

/**
 * Hands over the body piece by piece. One that breaks off or falls silent ends in `http-short` or
 * `http-stalled`. One that ends too early without the browser noticing simply ends: how long the file
 * is, the head does not say reliably, only the file itself. `fileBytes` gives that, once it is known.
 */
export async function* body(
  url: string,
  response: Response,
  signal: AbortSignal,
  fileBytes: () => number | undefined,
  stallMs: number = STALL_MS,
): AsyncGenerator<Uint8Array, void> {
  let bytes = 0;
  if (!response.body) return;
  const reader = response.body.getReader();
  try {
    for (;;) {
      const { done, value } = await unlessStalled(reader.read(), url, stallMs).catch(
        (cause: unknown) => {
          signal.throwIfAborted();
          if (cause instanceof PhotoError) throw cause;
          throw short(url, bytes, fileBytes(), cause);
        },
      );
      signal.throwIfAborted();
      if (done) break;
      bytes += value.byteLength;
      yield value;
    }
  } finally {
    // Also reached when the caller stops early: the rest of the body is not wanted.
    void reader.cancel().catch(() => {});
  }
}

/** A file that ended early. `expected` is left out where nothing says how long it is. */
export function short(
  url: string,
  bytes: number,
  expected: number | undefined,
  cause?: unknown,
): PhotoError {
  const of = expected === undefined ? '' : ` of ${expected}`;
  const why = cause === undefined ? '' : ` (${messageOf(cause)})`;
  return new PhotoError(
    'http-short',
    `${nameOf(url)} arrived incomplete: the transfer ended after ${bytes}${of} bytes${why}.`,
    cause,
  );
}

/** The last part of a URL's path, which is what people call a file. */
export function nameOf(url: string): string {
  const path = url.split(/[?#]/, 1)[0] ?? url;
  return path.split('/').filter(Boolean).pop() ?? url;
}

async function unlessStalled<T>(promise: Promise<T>, url: string, stallMs: number): Promise<T> {
  let timer: ReturnType<typeof setTimeout> | undefined;
  const stalled = new Promise<never>((_, reject) => {
    timer = setTimeout(() => {
      const seconds = Math.round(stallMs / 1000);
      reject(
        new PhotoError(
          'http-stalled',
          `${nameOf(url)} could not be loaded: nothing has arrived for ${seconds} seconds.`,
        ),
      );
    }, stallMs);
  });
  try {
    return await Promise.race([promise, stalled]);
  } finally {
    clearTimeout(timer);
  }
}
