/** The errors of a transfer. Each message names the file, the cause and, where there is one, the remedy. */

import type { ByteRange } from '../shared/byte-range.js';
import { messageOf, PhotoError } from '../shared/errors.js';

/** An error after which the same request may succeed. */
export class RetryableError extends PhotoError {
  constructor(
    code: string,
    message: string,
    cause?: unknown,
    /** The response's Retry-After header. */
    readonly retryAfter: string | null = null,
  ) {
    super(code, message, cause);
  }

  /** The error to report after `attempts` failed. */
  afterAttempts(attempts: number): PhotoError {
    if (attempts < 2) return this;
    return new PhotoError(this.code, `${this.message} It was tried ${attempts} times.`, this.cause);
  }
}

const RETRYABLE_STATUS = [408, 425, 429, 500, 502, 503, 504];

export function badStatus(url: string, response: Response): PhotoError {
  const status = `${response.status} ${response.statusText}`.trim();
  const message = `${fileName(url)} could not be loaded: the server answered ${status}.`;
  return RETRYABLE_STATUS.includes(response.status)
    ? new RetryableError('http-status', message, undefined, response.headers.get('retry-after'))
    : new PhotoError('http-status', message);
}

export function unreachable(url: string, cause: unknown): RetryableError {
  return new RetryableError(
    'http-network',
    `${fileName(url)} could not be fetched: the server cannot be reached, or its CORS headers do not ` +
      'allow this page to read the file.',
    cause,
  );
}

export function forbiddenByPolicy(url: string, directive: string, cause: unknown): PhotoError {
  const origin = URL.canParse(url) ? new URL(url).origin : "the file's origin";
  return new PhotoError(
    'csp-connect',
    `${fileName(url)} could not be fetched: add ${origin} to ${directive} of the page's content ` +
      'security policy.',
    cause,
  );
}

export function stalled(url: string, ms: number): RetryableError {
  return new RetryableError(
    'http-stalled',
    `${fileName(url)} could not be loaded: no data arrived for ${Math.round(ms / 1000)} seconds.`,
  );
}

/** The transfer ended at byte `at` of the file, but should have reached `end`. */
export function endedEarly(
  url: string,
  at: number,
  end: number | undefined,
  cause?: unknown,
): RetryableError {
  const before = end === undefined ? '' : `, before byte ${end}`;
  const why = cause === undefined ? '' : ` (${messageOf(cause)})`;
  return new RetryableError(
    'http-short',
    `${fileName(url)} is incomplete: the transfer ended at byte ${at}${before}${why}.`,
    cause,
  );
}

export function webPage(url: string, type: string): PhotoError {
  return new PhotoError(
    'http-type',
    `${fileName(url)} could not be loaded: the server sent a web page (${type}) instead.`,
  );
}

export function compressed(url: string, encoding: string): PhotoError {
  return new PhotoError(
    'http-encoding',
    `${fileName(url)} cannot be read in parts, because the server compresses it (${encoding}). ` +
      'Configure the server to send .ltm files without compression.',
  );
}

export function changed(url: string): PhotoError {
  return new PhotoError(
    'http-changed',
    `${fileName(url)} was replaced on the server during the transfer: load it again.`,
  );
}

/** The server sent other bytes than `range`. */
export function wrongRange(url: string, range: ByteRange, sent: string): PhotoError {
  return new PhotoError(
    'http-range',
    `${fileName(url)} cannot be read in parts: bytes ${rangeText(range)} were requested, but the server ` +
      `sent others (${sent}).`,
  );
}

/** The same code as the decoder's error for a truncated file. */
export function tooShort(url: string, range: ByteRange, size: number): PhotoError {
  return new PhotoError(
    'format-truncated',
    `${fileName(url)} is too short: bytes ${rangeText(range)} are needed, but the server has only ${size}.`,
  );
}

/** The same code as the decoder's error for data after the end of the photograph. */
export function tooLong(url: string, end: number, size: number): PhotoError {
  return new PhotoError(
    'format-invalid',
    `${fileName(url)} is too long: the photograph ends at byte ${end}, but the server has ${size}.`,
  );
}

export function rangeRefused(url: string, range: ByteRange): PhotoError {
  return new PhotoError(
    'http-range',
    `${fileName(url)} could not be loaded: the server says that it has no bytes ${rangeText(range)}.`,
  );
}

/** The last part of a URL's path. */
export function fileName(url: string): string {
  const path = url.split(/[?#]/, 1)[0] ?? url;
  return path.split('/').filter(Boolean).pop() ?? url;
}

function rangeText({ start, end }: ByteRange): string {
  return `${start} to ${end - 1}`;
}
