/** What the head of a server's answer says of the file, with every way this can go wrong told apart. */

import type { ByteRange } from '../shared/byte-range.js';
import { badStatus, compressed, otherPart, webPage } from './http-errors.js';

/** The head of an answer that brings bytes of the file. */
export interface Head {
  /** Whether the whole file comes, whatever was asked for. */
  readonly whole: boolean;
  /** Where in the file the body begins. */
  readonly from: number;
  /** Where in the file the body ends, as far as can be told. */
  readonly to: number | undefined;
  /** Bytes of the whole file, as far as can be told. */
  readonly size: number | undefined;
  readonly version: Version;
}

/** What tells one version of a file from another. */
export interface Version {
  /** A strong one: the same bytes have the same tag, others have another. */
  readonly etag?: string | undefined;
  readonly modified?: string | undefined;
}

/**
 * Reads the head of the answer to a request for a range, or for the whole file. Throws `http-status`,
 * `http-type`, `http-encoding` or `http-range` where the body is not what it should be.
 */
export function readHead(url: string, response: Response, asked: ByteRange | 'whole'): Head {
  const { status } = response;
  const whole = status === 200;
  if (!whole && (status !== 206 || asked === 'whole')) throw badStatus(url, response);
  const type = mediaType(response);
  if (type === 'text/html' || type === 'application/xhtml+xml') throw webPage(url, type);
  const version = { etag: strongTag(response), modified: header(response, 'last-modified') };
  if (whole) {
    const size = wholeBytes(response);
    return { whole, from: 0, to: size, size, version };
  }
  return { whole, ...readPart(url, response, asked as ByteRange), version };
}

/** The size of the file as an answer of status 416 tells it. */
export function sizeOfUnsatisfied(response: Response): number | undefined {
  const size = /^bytes \*\/(\d+)$/i.exec(header(response, 'content-range') ?? '')?.[1];
  return size === undefined ? undefined : Number(size);
}

/** Whether two answers cannot be of the same file. */
export function differ(a: Version, b: Version): boolean {
  if (a.etag !== undefined && b.etag !== undefined) return a.etag !== b.etag;
  return a.modified !== undefined && b.modified !== undefined && a.modified !== b.modified;
}

function readPart(
  url: string,
  response: Response,
  { start, end }: ByteRange,
): { from: number; to: number; size: number | undefined } {
  const encoding = encodingOf(response);
  if (encoding !== undefined) throw compressed(url, encoding);
  // Another origin's Content-Range is hidden unless the server exposes it; lengths are not.
  const said = header(response, 'content-range');
  const length = contentLength(response);
  const parts = /^bytes (\d+)-(\d+)\/(\d+|\*)$/i.exec(said ?? '');
  const from = parts ? Number(parts[1]) : start;
  const to = parts ? Number(parts[2]) + 1 : length ? start + length : end;
  const size = parts && parts[3] !== '*' ? Number(parts[3]) : undefined;
  const legible =
    parts !== null || (said === undefined && !mediaType(response)?.startsWith('multipart/'));
  if (!legible || from !== start || to <= from || to > end || to > (size ?? to)) {
    throw otherPart(url, { start, end }, said ?? `${length ?? 'other'} bytes`);
  }
  return { from, to, size };
}

/** The length of a whole file's answer, where that is sure to be the file's. */
function wholeBytes(response: Response): number | undefined {
  // With Content-Encoding, Content-Length counts compressed bytes and the body comes decompressed. Of
  // another origin's answer scripts may read the latter but not the former.
  const sure = encodingOf(response) === undefined && response.type !== 'cors';
  return sure ? contentLength(response) : undefined;
}

/** The entity tag, unless it is a weak one or that of the compressed file. */
function strongTag(response: Response): string | undefined {
  const tag = header(response, 'etag');
  return tag?.startsWith('W/') || encodingOf(response) !== undefined ? undefined : tag;
}

function contentLength(response: Response): number | undefined {
  const length = header(response, 'content-length');
  return length !== undefined && /^\d+$/.test(length) ? Number(length) : undefined;
}

function encodingOf(response: Response): string | undefined {
  const encoding = header(response, 'content-encoding');
  return encoding?.toLowerCase() === 'identity' ? undefined : encoding;
}

function mediaType(response: Response): string | undefined {
  return header(response, 'content-type')?.split(';', 1)[0]?.trim().toLowerCase();
}

function header(response: Response, name: string): string | undefined {
  return response.headers.get(name)?.trim() || undefined;
}
