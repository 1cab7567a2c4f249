/**
 * Reading parts of a file over HTTP as they arrive. Transfers that break off go on where they ended;
 * a server that knows no ranges, or that a browser does not ask for them, is read from start to end
 * instead.
 */

import { differ, type Head, readHead, sizeOfUnsatisfied, type Version } from './answer.js';
import { type ByteRange, bytesOf, coalesce, RangeSet } from './coalesce.js';
import { PhotoError } from './errors.js';
import * as errors from './http-errors.js';
import { Passing } from './http-errors.js';
import { type Job, merge } from './merge.js';
import { type ChancePorts, pauseMs, sleep, within } from './retry.js';

export type { ByteRange } from './coalesce.js';

/** Bytes of the file and where in it they lie. */
export interface Piece {
  readonly offset: number;
  readonly bytes: Uint8Array;
}

export interface SourceStats {
  readonly requests: number;
  /** What Range headers asked for, those of repeated requests included. */
  readonly bytesRequested: number;
  /** What came. */
  readonly bytesReceived: number;
  /** What was to be read, each byte counted once. */
  readonly bytesWanted: number;
  /** Whether the server sends the file as a whole only. */
  readonly whole: boolean;
}

/** What a source needs from the world around it. */
export interface SourcePorts extends ChancePorts {
  readonly fetch: typeof fetch;
  readonly sleep: (ms: number, signal: AbortSignal) => Promise<void>;
  /** Longest silence before a transfer counts as broken off. Slow lines trickle; a line that is
   * silent for this long has been lost without either end being told. */
  readonly stallMs: number;
}

export interface SourceOptions {
  /** How much to ask for at first, where the start of the file is wanted. */
  readonly firstBytes: number;
  /** Widest gap between two ranges that is fetched along with them. */
  readonly gapBytes: number;
  /** Requests under way at once. */
  readonly concurrency: number;
  /** Longest range to ask for at once, so that what matters less does not take up the line. */
  readonly maxRangeBytes: number;
  /** How often to ask again for a range of which nothing comes. */
  readonly retries: number;
}

const DEFAULT_PORTS: SourcePorts = {
  fetch: (input, init) => fetch(input, init),
  sleep,
  random: Math.random,
  now: Date.now,
  stallMs: 30_000,
};

const DEFAULT_OPTIONS: SourceOptions = {
  firstBytes: 1 << 14,
  gapBytes: 1 << 15,
  concurrency: 2,
  maxRangeBytes: 1 << 22,
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
  /** Ends what is under way; another one takes its place with every new try. */
  stop: AbortController;
}

/** A file behind an address. Meant for one `read` at a time. */
export class HttpSource {
  readonly url: string;
  readonly #ports: SourcePorts;
  readonly #options: SourceOptions;
  readonly #wanted = new RangeSet();
  readonly #asked: ByteRange[] = [];
  #requests = 0;
  #received = 0;
  #size: number | undefined;
  /** What the answers so far say of the file. */
  #version: Version | undefined;
  /** Once the server has answered with the whole file. */
  #whole: { delivered: number; done: boolean; sizeTold: boolean } | undefined;

  constructor(url: string, ports: Partial<SourcePorts> = {}, options: Partial<SourceOptions> = {}) {
    this.url = url;
    this.#ports = { ...DEFAULT_PORTS, ...ports };
    this.#options = { ...DEFAULT_OPTIONS, ...options };
  }

  /** Bytes of the whole file, once known. */
  get size(): number | undefined {
    return this.#size;
  }

  get stats(): SourceStats {
    // The first request may ask beyond the end of a small file.
    const limit = this.#size ?? Number.POSITIVE_INFINITY;
    return {
      requests: this.#requests,
      bytesRequested: bytesOf(this.#asked, limit),
      bytesReceived: this.#received,
      bytesWanted: this.#wanted.bytes(limit),
      whole: this.#whole !== undefined,
    };
  }

  /**
   * Hands over the bytes of ranges, the most important first, in pieces of any size as they arrive;
   * with them those between and after that came along. From a server that knows no ranges that is
   * the whole file, and further calls hand over nothing more. Ranges may reach beyond the file's end
   * only as long as its size is not known. Throws a `PhotoError`, or the signal's reason once aborted.
   */
  async *read(ranges: readonly ByteRange[], signal: AbortSignal): AsyncGenerator<Piece, void> {
    signal.throwIfAborted();
    const jobs = this.#plan(ranges).map((range) => this.#job(range));
    for await (const piece of merge(jobs, this.#options.concurrency, signal)) {
      // A part that was asked for before may still come in between.
      if (this.#whole?.delivered === piece.offset) this.#whole.delivered += piece.bytes.byteLength;
      yield piece;
    }
    this.#refuse(ranges, ({ start }, size) => start >= size);
  }

  /** What to ask for. */
  #plan(ranges: readonly ByteRange[]): ByteRange[] {
    this.#refuse(ranges, ({ end }, size) => end > size);
    for (const range of ranges) this.#wanted.add(range);
    if (this.#whole?.done) return [];
    if (this.#whole) return [{ start: this.#whole.delivered, end: Number.POSITIVE_INFINITY }];
    const { firstBytes, gapBytes, maxRangeBytes } = this.#options;
    const [first, ...others] = ranges;
    const opens = this.#version === undefined && first?.start === 0 && first.end > 0;
    const stretched = opens && { start: 0, end: Math.max(first.end, firstBytes) };
    const limits = { gapBytes, maxBytes: maxRangeBytes };
    return coalesce(stretched ? [stretched, ...others] : ranges, limits);
  }

  /** Refuses ranges that the file, if its size is known, turns out not to have. */
  #refuse(ranges: readonly ByteRange[], lacks: (range: ByteRange, size: number) => boolean): void {
    const size = this.#size;
    if (size === undefined) return;
    const lacking = ranges.find((range) => range.end > range.start && lacks(range, size));
    if (!lacking) return;
    // Where only the end of the transfer told the size, that end may have come too early.
    if (this.#whole && !this.#whole.sizeTold) throw errors.short(this.url, size, lacking.end);
    throw errors.tooShort(this.url, lacking, size);
  }

  #job({ start, end }: ByteRange): Job<Piece> {
    const stop = new AbortController();
    const transfer: Transfer = { start, at: start, end, inParts: !this.#whole, stop };
    return {
      run: (alone) => this.#pieces(transfer, alone),
      stop: (reason) => transfer.stop.abort(reason),
    };
  }

  /** One range, asked for as often as it takes. */
  async *#pieces(transfer: Transfer, alone: () => void): AsyncGenerator<Piece, void> {
    let failures = 0;
    for (;;) {
      transfer.end = Math.min(transfer.end, this.#size ?? transfer.end);
      const before = transfer.at;
      if (before >= transfer.end) return;
      try {
        yield* this.#attempt(transfer, alone);
        failures = 0;
      } catch (thrown) {
        transfer.stop.signal.throwIfAborted();
        if (!(thrown instanceof Passing)) throw thrown;
        failures = transfer.at === before ? failures + 1 : 1;
        if (failures > this.#options.retries) throw thrown.after(failures);
        // Browsers do not say why there is no answer. Some refuse what is compressed where a part was
        // asked for, some have another origin's server asked whether it allows that.
        const unheard = this.#version === undefined && thrown.code === 'http-network';
        if (unheard) transfer.inParts = failures % 2 === 1;
        transfer.stop.abort();
        transfer.stop = new AbortController();
        const { signal } = transfer.stop;
        const pause = this.#ports.sleep(pauseMs(thrown, failures, this.#ports), signal);
        await within(pause, signal);
      }
    }
  }

  /** What one request brings. */
  async *#attempt(transfer: Transfer, alone: () => void): AsyncGenerator<Piece, void> {
    const response = await this.#request(transfer);
    const reader = response.body?.getReader();
    try {
      // Another transfer's answer, with the whole file, may have come at the same moment.
      transfer.stop.signal.throwIfAborted();
      if (response.status === 416 && transfer.inParts) return this.#endBefore(transfer, response);
      const asked = { start: transfer.at, end: transfer.end };
      const head = readHead(this.url, response, transfer.inParts ? asked : 'whole');
      this.#recognise(head.version, head.size);
      if (head.whole && !this.#whole) {
        this.#whole = { delivered: 0, done: false, sizeTold: false };
        transfer.inParts = false;
        transfer.at = 0;
        transfer.end = Number.POSITIVE_INFINITY;
        alone();
      }
      if (reader) yield* this.#body(transfer, head, reader);
      else this.#finish(transfer, head, head.from);
    } finally {
      void reader?.cancel().catch(() => {});
    }
  }

  async #request(transfer: Transfer): Promise<Response> {
    const init: RequestInit = { signal: transfer.stop.signal };
    if (transfer.inParts) {
      const { at, end } = transfer;
      // The one header that other origins need not be asked to allow.
      init.headers = { Range: `bytes=${at}-${end - 1}` };
      this.#asked.push({ start: at, end });
    }
    this.#requests++;
    const { fetch } = this.#ports; // Browsers' own does not want to be called as a method.
    const answer = (async () => fetch(this.url, init))();
    return await this.#unlessSilent(answer, transfer, (cause) =>
      errors.unreachable(this.url, cause),
    );
  }

  /** Hands over the body, less what came before the last break. */
  async *#body(
    transfer: Transfer,
    head: Head,
    reader: ReadableStreamDefaultReader<Uint8Array>,
  ): AsyncGenerator<Piece, void> {
    const end = head.to ?? this.#size;
    let offset = head.from;
    for (;;) {
      const { done, value } = await this.#unlessSilent(reader.read(), transfer, (cause) =>
        errors.short(this.url, offset, end, cause),
      );
      if (done) break;
      this.#received += value.byteLength;
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
    this.#finish(transfer, head, offset);
  }

  /** The body has ended at `offset`. */
  #finish(transfer: Transfer, head: Head, offset: number): void {
    const end = head.to ?? this.#size;
    if (offset < Math.max(end ?? 0, transfer.at)) throw errors.short(this.url, offset, end);
    if (!this.#whole) return;
    this.#whole.sizeTold = this.#size !== undefined;
    this.#whole.done = true;
    this.#size = offset;
    transfer.end = offset;
  }

  /** Answers of status 416: the file ends before the range begins. */
  #endBefore(transfer: Transfer, response: Response): void {
    const told = sizeOfUnsatisfied(response);
    // All before has come, so there it ends.
    const end = told ?? (transfer.at > transfer.start ? transfer.at : undefined);
    if (end !== undefined) this.#recognise({}, end);
    if (end !== undefined && end <= transfer.at) return;
    throw errors.refused(this.url, { start: transfer.at, end: transfer.end });
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
    { stop: { signal } }: Transfer,
    failure: (cause: unknown) => Passing,
  ): Promise<T> {
    const ms = this.#ports.stallMs;
    const silence = () => errors.stalled(this.url, ms);
    return within(promise, signal, { ms, error: silence }).catch((cause: unknown) => {
      signal.throwIfAborted();
      throw cause instanceof PhotoError ? cause : failure(cause);
    });
  }
}
