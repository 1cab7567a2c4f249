/** Answers range requests and conditional requests (RFC 9110, sections 13 and 14). */

import { pipeline } from 'node:stream/promises';

/**
 * @typedef {object} Content
 * @property {number} size in bytes
 * @property {string} type MIME type
 * @property {string} etag a strong entity tag with its quotes: equal only for equal bytes
 * @property {(start: number, end: number) => AsyncIterable<Uint8Array> | Iterable<Uint8Array>} read
 *   reads the bytes from `start` to before `end`
 */

/**
 * Answers a GET or HEAD request for a file with the whole file (200), a range (206), or the news that the client's
 * copy is up to date (304). Headers that were set before are sent too.
 *
 * @param {import('node:http').IncomingMessage} request
 * @param {import('node:http').ServerResponse} response
 * @param {Content} content
 * @returns {Promise<void>} resolves when the response is sent, and rejects if it is interrupted
 */
export async function answer(request, response, { size, type, etag, read }) {
  const { headers, method } = request;
  response.setHeader('Accept-Ranges', 'bytes');
  response.setHeader('ETag', etag);
  if (matches(headers['if-none-match'], etag)) {
    response.writeHead(304).end();
    return;
  }
  // If-Range with a date is ignored: whole seconds are too coarse to identify a version.
  const ifRange = headers['if-range'];
  const partly = method === 'GET' && (ifRange === undefined || ifRange === etag);
  const range = partly ? rangeOf(headers.range, size) : undefined;
  if (range && range.start >= range.end) {
    response.writeHead(416, { 'Content-Range': `bytes */${size}` }).end();
    return;
  }
  const { start, end } = range ?? { start: 0, end: size };
  response.writeHead(range ? 206 : 200, {
    'Content-Type': type,
    'Content-Length': end - start,
    ...(range && { 'Content-Range': `bytes ${start}-${end - 1}/${size}` }),
  });
  if (method === 'HEAD' || start === end) response.end();
  else await pipeline(read(start, end), response);
}

/**
 * The range that a Range header requests, without the byte at `end`; empty if it lies beyond the file. `undefined` if
 * the whole file is the answer: the header is missing or invalid, or requests several ranges.
 *
 * @param {string | undefined} header
 * @param {number} size
 * @returns {{ start: number, end: number } | undefined}
 */
function rangeOf(header, size) {
  const [, first = '', last = ''] = /^bytes=(\d*)-(\d*)$/i.exec(header ?? '') ?? [];
  // A suffix: the last bytes of the file.
  if (first === '')
    return last === '' ? undefined : { start: Math.max(0, size - +last), end: size };
  if (last !== '' && +last < +first) return undefined;
  return { start: +first, end: last === '' ? size : Math.min(+last + 1, size) };
}

/**
 * Whether an If-None-Match header contains a tag.
 *
 * @param {string | undefined} header
 * @param {string} etag
 */
function matches(header, etag) {
  const tags = (header ?? '').split(',').map((tag) => tag.trim().replace(/^W\//, ''));
  return tags.includes('*') || tags.includes(etag);
}
