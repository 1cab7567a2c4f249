/**
 * Reading parts of a file over HTTP as they arrive. Transfers that break off go on where they ended;
 * a server that knows no ranges, or that a browser does not ask for them, is read from start to end
 * instead.
 */

import type { ByteRange } from '../shared/byte-range.js';
import { PhotoError } from '../shared/errors.js';
import * as errors from './http-errors.js';
import { Passing } from './http-errors.js';
import { differ, readHead, sizeOfUnsatisfied, type Version } from './response-head.js';
import { type ChancePorts, pauseMs, sleep, within } from './retry.js';

/** Bytes of the file and where in it they lie. */
export interface Piece {
  readonly offset: number;
  readonly bytes: Uint8Array;
}

/** What a source needs from the world around it, and how patient it is. */
export interface SourcePorts extends ChancePorts {
  readonly fetch: typeof fetch;
  readonly sleep: (ms: number, signal: AbortSignal) => Promise<void>;
  /** Longest silence before a transfer counts as broken off. Slow lines trickle; a line that is
   * silent for this long has been lost without either end being told. */
  readonly stallMs: number;
  /** How often to ask again for a range of which nothing comes. */
  readonly retries: number;
}

const DEFAULT_PORTS: Omit<SourcePorts, 'fetch'> = {
  sleep,
  random: Math.random,
  now: Date.now,
  stallMs: 30_000,
  retries: 4,
};

/** A range on its way. */
interface Transfer {
  readonly start: number;
  /** Where the next piece begins. */
  at: number;
  end: number;
  /** Whether a part is asked for, not the whole file. */
  inParts: boolean;
}

/** A file behind an address. Meant for one `read` at a time. */
export class HttpSource {
  readonly url: string;
  readonly #ports: SourcePorts;
  #size: number | undefined;
  /** Whether more than the end of a transfer has told it. */
  #sizeTold = true;
  /** What the answers so far say of the file. */
  #version: Version | undefined;
  /** The one that is left, once the server has answered with the whole file. */
  #whole: Transfer | undefined;

  constructor(url: string, ports: Pick<SourcePorts, 'fetch'> & Partial<SourcePorts>) {
    this.url = url;
    this.#ports = { ...DEFAULT_PORTS, ...ports };
  }

  /** Bytes of the whole file, once known. */
  get size(): number | undefined {
    return this.#size;
  }

  /**
   * Hands over the bytes of a range in pieces of any size as they arrive. From a server that knows no
   * ranges that is the whole file, and further calls hand over nothing more. The range may reach beyond
   * the file's end only as long as its size is not known. Throws a `PhotoError`, or the signal's reason
   * once aborted.
   */
  async *read(range: ByteRange, signal: AbortSignal): AsyncGenerator<Piece, void> {
    this.#refuse(range, range.end);
    const transfer = this.#whole ?? { ...range, at: range.start, inParts: true };
    let failures = 0;
    for (;;) {
      signal.throwIfAborted();
      transfer.end = Math.min(transfer.end, this.#size ?? transfer.end);
      const before = transfer.at;
      if (before >= transfer.end) break;
      try {
        yield* this.#attempt(transfer, signal);
        failures = 0;
      } catch (thrown) {
        if (!(thrown instanceof Passing)) throw thrown;
        failures = transfer.at === before ? failures + 1 : 1;
        if (failures > this.#ports.retries) throw thrown.after(failures);
        // Browsers do not say why there is no answer. Some refuse what is compressed where a part was
        // asked for, some have another origin's server asked whether it allows that.
        const unheard = this.#version === undefined && thrown.code === 'http-network';
        if (unheard) transfer.inParts = failures % 2 === 1;
        const pause = this.#ports.sleep(pauseMs(thrown, failures, this.#ports), signal);
        await within(pause, signal);
      }
    }
    this.#refuse(range, range.start + 1);
  }

  /** Refuses a range that needs a file up to `end`, if the file turns out to be shorter. */
  #refuse(range: ByteRange, end: number): void {
    const size = this.#size ?? end;
    if (size >= end) return;
    // Where only the end of the transfer told the size, that end may have come too early.
    if (!this.#sizeTold) throw errors.short(this.url, size, range.end);
    throw errors.tooShort(this.url, range, size);
  }

  /** Hands over what one request brings, less what came before the last break. */
  async *#attempt(transfer: Transfer, signal: AbortSignal): AsyncGenerator<Piece, void> {
    // What is under way ends with the attempt, however that ends.
    const stop = new AbortController();
    const stopToo = () => stop.abort(signal.reason);
    signal.addEventListener('abort', stopToo);
    try {
      const response = await this.#request(transfer, stop.signal);
      if (response.status === 416 && transfer.inParts) return this.#endBefore(transfer, response);
      const asked = { start: transfer.at, end: transfer.end };
      const head = readHead(this.url, response, transfer.inParts ? asked : 'whole');
      this.#recognise(head.version, head.size);
      if (head.whole && !this.#whole) {
        this.#whole = transfer;
        transfer.inParts = false;
        transfer.at = 0;
        transfer.end = Number.POSITIVE_INFINITY;
      }
      const end = head.to ?? this.#size;
      let offset = head.from;
      const reader = response.body?.getReader();
      while (reader) {
        const { done, value } = await this.#unlessSilent(reader.read(), stop.signal, (cause) =>
          errors.short(this.url, offset, end, cause),
        );
        if (done) break;
        const skip = transfer.at - offset;
        offset += value.byteLength;
        if (offset > (end ?? offset)) {
          if (head.whole) throw errors.changed(this.url);
          throw errors.otherPart(this.url, transfer, 'more of them');
        }
        if (skip >= value.byteLength) continue;
        const piece = { offset: transfer.at, bytes: value.subarray(skip) };
        transfer.at = offset;
        yield piece;
      }
      if (offset < Math.max(end ?? 0, transfer.at)) throw errors.short(this.url, offset, end);
      if (!this.#whole) return;
      this.#sizeTold = this.#size !== undefined;
      this.#size = offset;
    } finally {
      signal.removeEventListener('abort', stopToo);
      stop.abort();
    }
  }

  async #request({ inParts, at, end }: Transfer, signal: AbortSignal): Promise<Response> {
    // The one header that other origins need not be asked to allow.
    const init = { signal, ...(inParts && { headers: { Range: `bytes=${at}-${end - 1}` } }) };
    const { fetch } = this.#ports; // Browsers' own does not want to be called as a method.
    const answer = (async () => fetch(this.url, init))();
    return await this.#unlessSilent(answer, signal, (cause) => errors.unreachable(this.url, cause));
  }

  /** Answers of status 416: the file ends before the range begins. */
  #endBefore({ start, at, end }: Transfer, response: Response): void {
    // Where all before has come, there it ends.
    const size = sizeOfUnsatisfied(response) ?? (at > start ? at : undefined);
    this.#recognise({}, size);
    if (size === undefined || size > at) throw errors.refused(this.url, { start: at, end });
  }

  /** Makes sure that an answer is of the same file as those before. */
  #recognise(version: Version, size: number | undefined): void {
    const known = this.#version ?? version;
    if (differ(known, version) || (this.#size ?? size) !== (size ?? this.#size)) {
      throw errors.changed(this.url);
    }
    this.#version = {
      etag: known.etag ?? version.etag,
      modified: known.modified ?? version.modified,
    };
    this.#size ??= size;
  }

  /** Waits for what a request under way brings next. */
  #unlessSilent<T>(
    promise: Promise<T>,
    signal: AbortSignal,
    failure: (cause: unknown) => Passing,
  ): Promise<T> {
    const ms = this.#ports.stallMs;
    const end = () => Promise.reject(errors.stalled(this.url, ms));
    return within(promise, signal, { ms, end }).catch((cause: unknown) => {
      signal.throwIfAborted();
      throw cause instanceof PhotoError ? cause : failure(cause);
    });
  }
}
