/** Reads a response's status and headers, and recognises everything that can be wrong with them. */

import type { ByteRange } from '../shared/value-types.js';
import { badStatus, compressed, webPage, wrongRange } from './http-errors.js';

export interface ResponseHead {
  /** Whether the body is the whole file, whatever was requested. */
  readonly isWhole: boolean;
  readonly start: number;
  /** The byte of the file at which the body ends, if known. */
  readonly end: number | undefined;
  /** The size of the whole file, if known. */
  readonly size: number | undefined;
  readonly validators: HttpValidators;
}

export interface HttpValidators {
  /** A strong entity tag. */
  readonly etag?: string | undefined;
  readonly modified?: string | undefined;
}

/** Throws `http-status`, `http-type`, `http-encoding` or `http-range` if the body is not the requested data. */
export function readHead(
  url: string,
  response: Response,
  requested: ByteRange | 'whole',
): ResponseHead {
  const { status } = response;
  const isWhole = status === 200;
  if (!isWhole && (status !== 206 || requested === 'whole')) throw badStatus(url, response);
  const type = mediaType(response);
  if (type === 'text/html' || type === 'application/xhtml+xml') throw webPage(url, type);
  const validators = { etag: strongTag(response), modified: header(response, 'last-modified') };
  if (isWhole) {
    const size = wholeSize(response);
    return { isWhole, start: 0, end: size, size, validators };
  }
  return { isWhole, ...readContentRange(url, response, requested as ByteRange), validators };
}

/** The file's size as a response with status 416 gives it. */
export function sizeFromUnsatisfiedRange(response: Response): number | undefined {
  const size = /^bytes \*\/(\d+)$/i.exec(header(response, 'content-range') ?? '')?.[1];
  return size === undefined ? undefined : Number(size);
}

/** Whether two responses belong to different versions of the file for certain. */
export function isOtherVersion(a: HttpValidators, b: HttpValidators): boolean {
  if (a.etag !== undefined && b.etag !== undefined) return a.etag !== b.etag;
  return a.modified !== undefined && b.modified !== undefined && a.modified !== b.modified;
}

function readContentRange(url: string, response: Response, requested: ByteRange) {
  const encoding = contentEncoding(response);
  if (encoding !== undefined) throw compressed(url, encoding);
  // Browsers hide Content-Range of other origins unless the server exposes it, but not Content-Length.
  const text = header(response, 'content-range');
  const length = contentLength(response);
  const parts = /^bytes (\d+)-(\d+)\/(\d+|\*)$/i.exec(text ?? '');
  const start = parts ? Number(parts[1]) : requested.start;
  const end = parts ? Number(parts[2]) + 1 : length ? start + length : requested.end;
  const size = parts && parts[3] !== '*' ? Number(parts[3]) : undefined;
  const isReadable =
    parts !== null || (text === undefined && !mediaType(response)?.startsWith('multipart/'));
  const isRequested = start === requested.start && end > start && end <= requested.end;
  if (!isReadable || !isRequested || end > (size ?? end)) {
    throw wrongRange(url, requested, text ?? `${length ?? 'other'} bytes`);
  }
  return { start, end, size };
}

/** The size of a file that is sent whole, if Content-Length is certain to be that size. */
function wholeSize(response: Response): number | undefined {
  // With Content-Encoding, Content-Length counts compressed bytes. Of other origins, scripts can read Content-Length
  // but not Content-Encoding.
  const isCertain = contentEncoding(response) === undefined && response.type !== 'cors';
  return isCertain ? contentLength(response) : undefined;
}

/** The entity tag, unless it is weak or that of a compressed representation. */
function strongTag(response: Response): string | undefined {
  const tag = header(response, 'etag');
  return tag?.startsWith('W/') || contentEncoding(response) !== undefined ? undefined : tag;
}

function contentLength(response: Response): number | undefined {
  const length = header(response, 'content-length');
  return length !== undefined && /^\d+$/.test(length) ? Number(length) : undefined;
}

function contentEncoding(response: Response): string | undefined {
  const encoding = header(response, 'content-encoding');
  return encoding?.toLowerCase() === 'identity' ? undefined : encoding;
}

function mediaType(response: Response): string | undefined {
  return header(response, 'content-type')?.split(';', 1)[0]?.trim().toLowerCase();
}

function header(response: Response, name: string): string | undefined {
  return response.headers.get(name)?.trim() || undefined;
}
