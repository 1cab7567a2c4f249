/** What can go wrong with a file on its way, in words. */

import type { ByteRange } from '../shared/byte-range.js';
import { messageOf, PhotoError } from '../shared/errors.js';

/** A failure that may pass when asked again. */
export class Passing extends PhotoError {
  constructor(
    code: string,
    message: string,
    cause?: unknown,
    /** The server's Retry-After. */
    readonly retryAfter: string | null = null,
  ) {
    super(code, message, cause);
  }

  /** What people are told once asking again has been given up. */
  after(tries: number): PhotoError {
    if (tries < 2) return this;
    return new PhotoError(this.code, `${this.message} It was tried ${tries} times.`, this.cause);
  }
}

/** Statuses after which the same request may well succeed. */
const PASSING_STATUS = [408, 425, 429, 500, 502, 503, 504];

export function badStatus(url: string, response: Response): PhotoError {
  const status = `${response.status} ${response.statusText}`.trim();
  const message = `${nameOf(url)} could not be loaded: the server answered ${status}.`;
  return PASSING_STATUS.includes(response.status)
    ? new Passing('http-status', message, undefined, response.headers.get('retry-after'))
    : new PhotoError('http-status', message);
}

export function unreachable(url: string, cause: unknown): Passing {
  return new Passing(
    'http-network',
    `${nameOf(url)} could not be fetched: the server cannot be reached, or does not allow this ` +
      'page to read the file.',
    cause,
  );
}

/** A content security policy keeps the page from asking. */
export function forbidden(url: string, directive: string, cause: unknown): PhotoError {
  const origin = URL.canParse(url) ? new URL(url).origin : "the file's address";
  return new PhotoError(
    'csp-connect',
    `${nameOf(url)} may not be fetched: the page's content security policy has to allow ` +
      `${origin} in ${directive}.`,
    cause,
  );
}

export function stalled(url: string, ms: number): Passing {
  return new Passing(
    'http-stalled',
    `${nameOf(url)} could not be loaded: nothing has arrived for ${Math.round(ms / 1000)} seconds.`,
  );
}

/** The transfer ended at byte `at` of the file, and should not have before byte `end`. */
export function short(url: string, at: number, end: number | undefined, cause?: unknown): Passing {
  const before = end === undefined ? '' : `, before byte ${end}`;
  const why = cause === undefined ? '' : ` (${messageOf(cause)})`;
  return new Passing(
    'http-short',
    `${nameOf(url)} arrived incomplete: the transfer ended at byte ${at}${before}${why}.`,
    cause,
  );
}

export function webPage(url: string, type: string): PhotoError {
  return new PhotoError(
    'http-type',
    `${nameOf(url)} could not be loaded: the server sent a web page (${type}) in its place.`,
  );
}

export function compressed(url: string, encoding: string): PhotoError {
  return new PhotoError(
    'http-encoding',
    `${nameOf(url)} cannot be read in parts: the server compresses it (${encoding}). It should ` +
      'serve files of this kind without compression.',
  );
}

export function changed(url: string): PhotoError {
  return new PhotoError(
    'http-changed',
    `${nameOf(url)} was replaced on the server while it was being read: load it again.`,
  );
}

export function otherPart(url: string, range: ByteRange, sent: string): PhotoError {
  return new PhotoError(
    'http-range',
    `${nameOf(url)} cannot be read in parts: asked for bytes ${inWords(range)}, the server sent ` +
      `others (${sent}).`,
  );
}

/** To pages the same as what a decoder says of a file that is cut short. */
export function tooShort(url: string, range: ByteRange, size: number): PhotoError {
  return new PhotoError(
    'format-truncated',
    `${nameOf(url)} is too short: bytes ${inWords(range)} are needed, but the server has only ${size}.`,
  );
}

/** To pages the same as what a decoder says of a file with something after its end. */
export function tooLong(url: string, end: number, size: number): PhotoError {
  return new PhotoError(
    'format-invalid',
    `${nameOf(url)} goes on after its end at byte ${end}: the server has ${size}.`,
  );
}

export function refused(url: string, range: ByteRange): PhotoError {
  return new PhotoError(
    'http-range',
    `${nameOf(url)} could not be loaded: the server says that it has no bytes ${inWords(range)}.`,
  );
}

/** The last part of a URL's path, which is what people call a file. */
export function nameOf(url: string): string {
  const path = url.split(/[?#]/, 1)[0] ?? url;
  return path.split('/').filter(Boolean).pop() ?? url;
}

function inWords({ start, end }: ByteRange): string {
  return `${start} to ${end - 1}`;
}
