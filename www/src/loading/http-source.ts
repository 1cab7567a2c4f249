/**
 * Reads ranges of a file over HTTP. An interrupted transfer continues where it ended. If the server ignores ranges, or
 * the browser does not request them, the file is read from start to end instead.
 */

import { PhotoError } from '../shared/errors.js';
import { linkedController, withTimeout } from '../shared/promises.js';
import type { ByteRange } from '../shared/value-types.js';
import * as errors from './http-errors.js';
import { RetryableError } from './http-errors.js';
import {
  type HttpValidators,
  isOtherVersion,
  readHead,
  sizeFromUnsatisfiedRange,
} from './response-head.js';
import { type RetryPorts, retryPauseMs, sleep } from './retry.js';

/** Bytes of the file that begin at `offset`. */
export interface FetchedPiece {
  readonly offset: number;
  readonly bytes: Uint8Array;
}

export interface HttpSourcePorts extends RetryPorts {
  readonly fetch: typeof fetch;
  readonly sleep: (ms: number, signal: AbortSignal) => Promise<void>;
  /** Silence after which a transfer counts as interrupted, in milliseconds. */
  readonly stallMs: number;
  /** How often a range is requested again without receiving anything. */
  readonly maxRetries: number;
}

const DEFAULT_PORTS: Omit<HttpSourcePorts, 'fetch'> = {
  sleep,
  random: Math.random,
  now: Date.now,
  stallMs: 30_000,
  maxRetries: 4,
};

interface RangeTransfer {
  readonly start: number;
  /** The start of the next piece. */
  position: number;
  end: number;
  /** Whether the range is requested, and not the whole file. */
  usesRange: boolean;
}

/** A file at a URL. Only one `read` may run at a time. */
export class HttpSource {
  readonly #ports: HttpSourcePorts;
  /** Size of the whole file in bytes, once known. */
  size: number | undefined;
  /** Whether a header has told the size, and not only the end of a transfer. */
  #isSizeCertain = true;
  #validators: HttpValidators | undefined;
  /** The transfer of the whole file, once the server has sent it instead of a range. */
  #wholeTransfer: RangeTransfer | undefined;

  constructor(
    readonly url: string,
    ports: Pick<HttpSourcePorts, 'fetch'> & Partial<HttpSourcePorts>,
  ) {
    this.#ports = { ...DEFAULT_PORTS, ...ports };
  }

  /**
   * Yields the bytes of a range as they arrive. If the server ignores ranges, the first call yields the whole file and
   * later calls nothing. The range may exceed the file only while its size is unknown. Throws a `PhotoError`, or the
   * signal's reason if it is aborted.
   */
  async *read(range: ByteRange, signal: AbortSignal): AsyncGenerator<FetchedPiece, void> {
    this.#checkSize(range, range.end);
    const transfer = this.#wholeTransfer ?? { ...range, position: range.start, usesRange: true };
    let failures = 0;
    for (;;) {
      signal.throwIfAborted();
      transfer.end = Math.min(transfer.end, this.size ?? transfer.end);
      const { position } = transfer;
      if (position >= transfer.end) break;
      try {
        yield* this.#attempt(transfer, signal);
        failures = 0;
      } catch (thrown) {
        if (!(thrown instanceof RetryableError)) throw thrown;
        failures = transfer.position === position ? failures + 1 : 1;
        if (failures > this.#ports.maxRetries) throw thrown.afterAttempts(failures);
        // A missing response has no reason: the range header may be the cause, which some browsers refuse for
        // compressed files, and for which some ask another origin's server for permission first.
        const hasNoResponse = this.#validators === undefined && thrown.code === 'http-network';
        if (hasNoResponse) transfer.usesRange = failures % 2 === 1;
        const pause = this.#ports.sleep(retryPauseMs(thrown, failures, this.#ports), signal);
        await withTimeout(pause, { signal });
      }
    }
    this.#checkSize(range, range.start + 1);
  }

  /** Throws if the file is known to end before `end`. */
  #checkSize(range: ByteRange, end: number): void {
    const size = this.size ?? end;
    if (size >= end) return;
    if (!this.#isSizeCertain) throw errors.endedEarly(this.url, size, range.end);
    throw errors.tooShort(this.url, range, size);
  }

  /** Sends one request and yields its bytes, without those received before an interruption. */
  async *#attempt(
    transfer: RangeTransfer,
    signal: AbortSignal,
  ): AsyncGenerator<FetchedPiece, void> {
    // However the attempt ends, its request ends too.
    const stop = linkedController(signal);
    try {
      const response = await this.#request(transfer, stop.signal);
      if (response.status === 416 && transfer.usesRange) return this.#endBefore(transfer, response);
      const requested = { start: transfer.position, end: transfer.end };
      const head = readHead(this.url, response, transfer.usesRange ? requested : 'whole');
      this.#checkVersion(head.validators, head.size);
      if (head.isWhole && !this.#wholeTransfer) {
        this.#wholeTransfer = transfer;
        transfer.usesRange = false;
        transfer.position = 0;
        transfer.end = Number.POSITIVE_INFINITY;
      }
      const end = head.end ?? this.size;
      let offset = head.start;
      const reader = response.body?.getReader();
      while (reader) {
        const { done, value } = await this.#untilStalled(reader.read(), stop.signal, (cause) =>
          errors.endedEarly(this.url, offset, end, cause),
        );
        if (done) break;
        const skip = transfer.position - offset;
        offset += value.byteLength;
        if (offset > (end ?? offset)) {
          if (head.isWhole) throw errors.changed(this.url);
          throw errors.wrongRange(this.url, requested, 'more of them');
        }
        if (skip >= value.byteLength) continue;
        const piece = { offset: transfer.position, bytes: value.subarray(skip) };
        transfer.position = offset;
        yield piece;
      }
      if (offset < Math.max(end ?? 0, transfer.position)) {
        throw errors.endedEarly(this.url, offset, end);
      }
      if (!this.#wholeTransfer) return;
      this.#isSizeCertain = this.size !== undefined;
      this.size = offset;
    } finally {
      stop.abort();
    }
  }

  #request({ usesRange, position, end }: RangeTransfer, signal: AbortSignal): Promise<Response> {
    // Range is the only header here that needs no permission of another origin.
    const headers = { Range: `bytes=${position}-${end - 1}` };
    const { fetch } = this.#ports; // The browser's `fetch` cannot be called as a method.
    const response = (async () => fetch(this.url, { signal, ...(usesRange && { headers }) }))();
    return this.#untilStalled(response, signal, (cause) => errors.unreachable(this.url, cause));
  }

  /** Handles status 416: the file ends before the requested range. */
  #endBefore({ start, position, end }: RangeTransfer, response: Response): void {
    // If everything before this position has arrived, the file ends here.
    const size = sizeFromUnsatisfiedRange(response) ?? (position > start ? position : undefined);
    this.#checkVersion({}, size);
    if (size === undefined || size > position) {
      throw errors.rangeRefused(this.url, { start: position, end });
    }
  }

  /** Throws if a response belongs to another version of the file than the ones before. */
  #checkVersion(validators: HttpValidators, size: number | undefined): void {
    const known = this.#validators ?? validators;
    if (isOtherVersion(known, validators) || (this.size ?? size) !== (size ?? this.size)) {
      throw errors.changed(this.url);
    }
    const { etag = validators.etag, modified = validators.modified } = known;
    this.#validators = { etag, modified };
    this.size ??= size;
  }

  /** Waits for the next data of a request. */
  #untilStalled<T>(
    promise: Promise<T>,
    signal: AbortSignal,
    toError: (cause: unknown) => PhotoError,
  ): Promise<T> {
    const ms = this.#ports.stallMs;
    const onTimeout = () => Promise.reject(errors.stalled(this.url, ms));
    return withTimeout(promise, { signal, ms, onTimeout }).catch((cause: unknown) => {
      signal.throwIfAborted();
      throw cause instanceof PhotoError ? cause : toError(cause);
    });
  }
}
