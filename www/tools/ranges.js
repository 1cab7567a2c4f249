/** Answers for files of which parts are asked for, as RFC 9110 has them (sections 13 and 14). */

import { pipeline } from 'node:stream/promises';

/**
 * @typedef {object} Content
 * @property {number} size in bytes
 * @property {string} type MIME type
 * @property {string} etag a strong one, with its quotes: the same for the same bytes only
 * @property {(start: number, end: number) => AsyncIterable<Uint8Array> | Iterable<Uint8Array>} read
 *   gives the bytes from `start` to before `end`
 */

/**
 * Answers a GET or HEAD request for a file: with all of it, with the part that is asked for, or with
 * the word that what the client has is still right. Headers set before go along.
 *
 * @param {import('node:http').IncomingMessage} request
 * @param {import('node:http').ServerResponse} response
 * @param {Content} content
 * @returns {Promise<void>} settles when the answer is out, and rejects where it cannot be given whole
 */
export async function answer(request, response, { size, type, etag, read }) {
  const { headers, method } = request;
  response.setHeader('Accept-Ranges', 'bytes');
  response.setHeader('ETag', etag);
  if (matches(headers['if-none-match'], etag)) {
    response.writeHead(304).end();
    return;
  }
  // Dates tell whole seconds only: too few to be sure that two parts are of the same file.
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
 * The part of a file that a Range header asks for, half open and empty where the file has none of
 * it. Undefined where all of the file is the answer: where the header is missing or makes no sense,
 * and where it asks for several parts at once.
 *
 * @param {string | undefined} header
 * @param {number} size
 * @returns {{ start: number, end: number } | undefined}
 */
function rangeOf(header, size) {
  const [, first = '', last = ''] = /^bytes=(\d*)-(\d*)$/i.exec(header ?? '') ?? [];
  // The last so many bytes.
  if (first === '')
    return last === '' ? undefined : { start: Math.max(0, size - +last), end: size };
  if (last !== '' && +last < +first) return undefined;
  return { start: +first, end: last === '' ? size : Math.min(+last + 1, size) };
}

/**
 * Whether an If-None-Match header has a tag in its list.
 *
 * @param {string | undefined} header
 * @param {string} etag
 */
function matches(header, etag) {
  const tags = (header ?? '').split(',').map((tag) => tag.trim().replace(/^W\//, ''));
  return tags.includes('*') || tags.includes(etag);
}
