/** The errors of a transfer. Each message names the file, the cause and, where there is one, the remedy. */

import { explainOffline, messageOf, PhotoError } from '../shared/errors.js';
import type { ByteRange } from '../shared/value-types.js';

/** An error after which the same request may succeed. */
export class RetryableError extends PhotoError {
  /** The response's Retry-After header. */
  retryAfter: string | null = null;

  /** The error to report after `attempts` failed. */
  afterAttempts(attempts: number): PhotoError {
    if (attempts < 2) return this;
    return new PhotoError(this.code, `${this.message} It was tried ${attempts} times.`, this.cause);
  }
}

const RETRYABLE_STATUS = [408, 425, 429, 500, 502, 503, 504];

export function badStatus(url: string, response: Response): PhotoError {
  const status = `${response.status} ${response.statusText}`.trim();
  const text = `could not be loaded: the server answered ${status}.`;
  if (!RETRYABLE_STATUS.includes(response.status)) return fileError('http-status', url, text);
  const error = retryable('http-status', url, text);
  error.retryAfter = response.headers.get('retry-after');
  return error;
}

/** Worth a retry, unless this device is offline. */
export function unreachable(url: string, cause: unknown): PhotoError {
  const why = 'cannot be reached, or its CORS headers do not allow this page to read the file';
  const text = `could not be fetched: the server ${why}.`;
  return explainOffline(retryable('http-network', url, text, cause));
}

export function forbiddenByPolicy(url: string, directive: string, cause: unknown): PhotoError {
  const origin = URL.canParse(url) ? new URL(url).origin : "the file's origin";
  const remedy = `add ${origin} to ${directive} of the page's content security policy`;
  return fileError('csp-connect', url, `could not be fetched: ${remedy}.`, cause);
}

export function stalled(url: string, ms: number): RetryableError {
  const text = `could not be loaded: no data arrived for ${Math.round(ms / 1000)} seconds.`;
  return retryable('http-stalled', url, text);
}

/** The transfer ended at byte `at` of the file, but should have reached `end`. */
export function endedEarly(url: string, at: number, end: number | undefined, cause?: unknown) {
  const before = end === undefined ? '' : `, before byte ${end}`;
  const why = cause === undefined ? '' : ` (${messageOf(cause)})`;
  const text = `is incomplete: the transfer ended at byte ${at}${before}${why}.`;
  return retryable('http-short', url, text, cause);
}

export function webPage(url: string, type: string): PhotoError {
  const sent = `the server sent a web page (${type}) instead`;
  return fileError('http-type', url, `could not be loaded: ${sent}.`);
}

export function compressed(url: string, encoding: string): PhotoError {
  const text = `cannot be read in parts, because the server compresses it (${encoding}).`;
  const remedy = 'Configure the server to send .ltm files without compression.';
  return fileError('http-encoding', url, `${text} ${remedy}`);
}

export function changed(url: string): PhotoError {
  const text = 'was replaced on the server during the transfer: load it again.';
  return fileError('http-changed', url, text);
}

/** The server sent other bytes than `range`. */
export function wrongRange(url: string, range: ByteRange, sent: string): PhotoError {
  const reason = `bytes ${rangeText(range)} were requested, but the server sent others (${sent})`;
  return fileError('http-range', url, `cannot be read in parts: ${reason}.`);
}

/** The same code as the decoder's error for a truncated file. */
export function tooShort(url: string, range: ByteRange, size: number): PhotoError {
  const reason = `bytes ${rangeText(range)} are needed, but the server has only ${size}`;
  return fileError('format-truncated', url, `is too short: ${reason}.`);
}

/** The same code as the decoder's error for data after the end of the photograph. */
export function tooLong(url: string, end: number, size: number): PhotoError {
  const reason = `the photograph ends at byte ${end}, but the server has ${size}`;
  return fileError('format-invalid', url, `is too long: ${reason}.`);
}

export function rangeRefused(url: string, range: ByteRange): PhotoError {
  const reason = `the server says that it has no bytes ${rangeText(range)}`;
  return fileError('http-range', url, `could not be loaded: ${reason}.`);
}

/** The server sends the whole file in place of a shard. */
export function rangeIgnored(url: string): PhotoError {
  return fileError('http-range', url, 'is shown coarsely: its server must support range requests.');
}

/** The last part of a URL's path. */
export function fileName(url: string): string {
  const path = url.split(/[?#]/, 1)[0] ?? url;
  return path.split('/').filter(Boolean).pop() ?? url;
}

function fileError(code: string, url: string, text: string, cause?: unknown): PhotoError {
  return new PhotoError(code, `${fileName(url)} ${text}`, cause);
}

function retryable(code: string, url: string, text: string, cause?: unknown): RetryableError {
  return new RetryableError(code, `${fileName(url)} ${text}`, cause);
}

function rangeText({ start, end }: ByteRange): string {
  return `${start} to ${end - 1}`;
}
