/** HTTP servers and readers for tests of the loader. */

import assert from 'node:assert/strict';
import { once } from 'node:events';
import {
  createServer,
  type IncomingMessage,
  type OutgoingHttpHeaders,
  type ServerResponse,
} from 'node:http';
import type { AddressInfo } from 'node:net';
import type { TestContext } from 'node:test';
import type { ByteRange } from '../shared/value-types.js';
import { HttpSource, type HttpSourcePorts } from './http-source.js';

/** A signal that is never aborted. */
export const never = new AbortController().signal;

/** A file whose bytes differ from place to place. */
export function fileOf(length: number): Buffer {
  const file = Buffer.alloc(length);
  for (let i = 0; i < length; i++) file[i] = (i * 31 + (i >> 8) * 17 + (i >> 16) * 7) & 255;
  return file;
}

export function range(start: number, end: number): ByteRange {
  return { start, end };
}

/** The range that a request asks for. */
export function requestedRange(request: IncomingMessage): ByteRange | undefined {
  const parts = /^bytes=(\d+)-(\d+)$/.exec(request.headers.range ?? '');
  return parts ? range(Number(parts[1]), Number(parts[2]) + 1) : undefined;
}

interface ResponseOptions {
  readonly headers?: OutgoingHttpHeaders;
  /** Omits Content-Range, as browsers do for other origins. */
  readonly hideRange?: boolean;
  /** Bytes after which the connection breaks. */
  readonly breakAfter?: number;
}

/** Answers as a server with ranges. */
export function respond(
  request: IncomingMessage,
  response: ServerResponse,
  file: Buffer,
  { headers = {}, hideRange = false, breakAfter }: ResponseOptions = {},
): void {
  const requested = requestedRange(request);
  if (!requested) {
    response.writeHead(200, { 'content-length': file.length, ...headers });
    sendBody(response, file, breakAfter);
    return;
  }
  const end = Math.min(requested.end, file.length);
  if (requested.start >= file.length) {
    response.writeHead(416, hideRange ? {} : { 'content-range': `bytes */${file.length}` });
    response.end();
    return;
  }
  const contentRange = `bytes ${requested.start}-${end - 1}/${file.length}`;
  response.writeHead(206, {
    'content-length': end - requested.start,
    ...(!hideRange && { 'content-range': contentRange }),
    ...headers,
  });
  sendBody(response, file.subarray(requested.start, end), breakAfter);
}

/** Sends a body, or breaks the connection after `breakAfter` bytes. */
export function sendBody(response: ServerResponse, bytes: Buffer, breakAfter = bytes.length): void {
  if (breakAfter >= bytes.length) response.end(bytes);
  else response.write(bytes.subarray(0, breakAfter), () => response.socket?.destroySoon());
}

type Handler = (request: IncomingMessage, response: ServerResponse, count: number) => unknown;

export interface TestServer {
  readonly url: string;
  /** The ranges that were requested, in order; `undefined` for the whole file. */
  readonly ranges: (string | undefined)[];
  readonly requests: IncomingMessage[];
  /** Settle when a response has ended, on either side. */
  readonly closed: Promise<unknown>[];
}

/** A server for one test. `handler` gets the number of the request, which starts at 1. */
export async function serve(t: TestContext, handler: Handler): Promise<TestServer> {
  const ranges: (string | undefined)[] = [];
  const requests: IncomingMessage[] = [];
  const closed: Promise<unknown>[] = [];
  const server = createServer((request, response) => {
    closed.push(once(response, 'close'));
    ranges.push(request.headers.range?.replace('bytes=', ''));
    handler(request, response, requests.push(request));
  });
  server.listen(0, '127.0.0.1');
  await once(server, 'listening');
  t.after(() => {
    server.close();
    server.closeAllConnections();
  });
  const { port } = server.address() as AddressInfo;
  return { url: `http://127.0.0.1:${port}/windows/rose.ltm?v=2`, ranges, requests, closed };
}

interface TestSource {
  readonly source: HttpSource;
  /** The pauses before retries, in milliseconds. */
  readonly pauses: number[];
}

/** A source whose pauses take no time. */
export function createSource(url: string, ports: Partial<HttpSourcePorts> = {}): TestSource {
  const pauses: number[] = [];
  const sleep = async (ms: number) => {
    pauses.push(ms);
  };
  const source = new HttpSource(url, { fetch, sleep, random: () => 0.5, ...ports });
  return { source, pauses };
}

/** The bytes that a reader has received. */
export class ReceivedFile {
  readonly bytes: Buffer;
  /** How often each byte was received. */
  readonly counts: Uint8Array;

  constructor(length: number) {
    this.bytes = Buffer.alloc(length);
    this.counts = new Uint8Array(length);
  }

  async read(source: HttpSource, requested: ByteRange, signal = never): Promise<this> {
    for await (const { offset, bytes } of source.read(requested, signal)) {
      assert.ok(bytes.byteLength > 0 && offset + bytes.byteLength <= this.bytes.length);
      this.bytes.set(bytes, offset);
      for (let i = 0; i < bytes.byteLength; i++) (this.counts[offset + i] as number)++;
    }
    return this;
  }

  /** Asserts that exactly these ranges, which do not overlap, were received, each byte once. */
  assertEqual(file: Buffer, ...ranges: ByteRange[]): void {
    let unexpected = this.counts.reduce((sum, count) => sum + count, 0);
    for (const { start, end } of ranges) {
      unexpected -= end - start;
      assert.ok(this.bytes.subarray(start, end).equals(file.subarray(start, end)), 'same bytes');
      assert.ok(
        this.counts.subarray(start, end).every((count) => count === 1),
        'each once',
      );
    }
    assert.equal(unexpected, 0, 'nothing else');
  }
}

/** Reads a range and drops its bytes. */
export async function drain(
  source: HttpSource,
  requested: ByteRange,
  signal = never,
): Promise<void> {
  await new ReceivedFile(1 << 22).read(source, requested, signal);
}
