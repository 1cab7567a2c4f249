/** Which bytes of a file to ask for in one request. */

/** Bytes of a file; half open. */
export interface ByteRange {
  readonly start: number;
  readonly end: number;
}

export interface CoalesceLimits {
  /** What a request less is worth: the widest gap that is fetched along with its neighbours, and the
   * most that is fetched ahead of what matters more. */
  readonly gapBytes: number;
  /** Longest range to ask for at once. */
  readonly maxBytes: number;
}

/** Bytes that may be fetched for nothing, in order to save requests, as a share of those wanted. */
const WASTE = 0.05;

/**
 * Turns ranges, the most important first, into disjoint ones that are each worth a request, in the
 * same order. Ranges that follow one another in the list and lie next to each other, or nearly so,
 * become one.
 */
export function coalesce(ranges: readonly ByteRange[], limits: CoalesceLimits): ByteRange[] {
  const wanted = new RangeSet();
  const fresh = ranges.flatMap((range) => wanted.add(range));
  const bridged = bridges(fresh, limits.gapBytes, WASTE * wanted.bytes());
  // A bridge may lead across bytes that are in the list elsewhere.
  const asked = new RangeSet();
  return join(fresh, bridged, limits.gapBytes)
    .flatMap((range) => asked.add(range))
    .flatMap((range) => split(range, limits.maxBytes));
}

/** Bytes between two ranges, whichever comes first. */
function gapOf(a: ByteRange, b: ByteRange): number {
  return Math.max(b.start - a.end, a.start - b.end);
}

/**
 * The ranges to be joined with the one before them in the list, although there is a gap. The narrow
 * gaps come first, since each saves as much as a wide one.
 */
function bridges(
  ranges: readonly ByteRange[],
  widest: number,
  budget: number,
): ReadonlySet<ByteRange> {
  const gaps = ranges
    .slice(1)
    .map((next, i) => ({ next, gap: gapOf(ranges[i] as ByteRange, next) }))
    .sort((a, b) => a.gap - b.gap);
  const bridged = new Set<ByteRange>();
  let waste = 0;
  for (const { next, gap } of gaps) {
    waste += gap;
    if (gap > widest || waste > budget) break;
    bridged.add(next);
  }
  return bridged;
}

/** Joins ranges to the one before them in the list. */
function join(
  ranges: readonly ByteRange[],
  bridged: ReadonlySet<ByteRange>,
  mostAhead: number,
): ByteRange[] {
  const joined: ByteRange[] = [];
  // Where the most important part of the last one begins.
  let heart = 0;
  for (const next of ranges) {
    const before = joined.at(-1);
    // A request brings first what lies first in the file, whatever matters more.
    const near = before && (gapOf(before, next) <= 0 || bridged.has(next));
    if (near && heart - next.start <= mostAhead) {
      const start = Math.min(before.start, next.start);
      joined[joined.length - 1] = { start, end: Math.max(before.end, next.end) };
    } else {
      joined.push(next);
      heart = next.start;
    }
  }
  return joined;
}

function split(range: ByteRange, maxBytes: number): ByteRange[] {
  const parts: ByteRange[] = [];
  for (let start = range.start; start < range.end; start += maxBytes) {
    parts.push({ start, end: Math.min(range.end, start + maxBytes) });
  }
  return parts;
}

/** A set of bytes, held as the ranges that make it up. */
export class RangeSet {
  /** Ascending, with gaps between them. */
  readonly #ranges: ByteRange[] = [];

  /** Adds a range and returns the parts of it that were missing. */
  add(range: ByteRange): ByteRange[] {
    if (range.end <= range.start) return [];
    const missing: ByteRange[] = [];
    const first = this.#firstEndingFrom(range.start);
    let { start, end } = range;
    let at = start;
    let next = first;
    for (; next < this.#ranges.length; next++) {
      const held = this.#ranges[next] as ByteRange;
      if (held.start > range.end) break;
      if (held.start > at) missing.push({ start: at, end: held.start });
      at = Math.max(at, held.end);
      start = Math.min(start, held.start);
      end = Math.max(end, held.end);
    }
    if (at < range.end) missing.push({ start: at, end: range.end });
    this.#ranges.splice(first, next - first, { start, end });
    return missing;
  }

  /** How many bytes there are, those from `limit` on left out. */
  bytes(limit: number = Number.POSITIVE_INFINITY): number {
    return bytesOf(this.#ranges, limit);
  }

  #firstEndingFrom(offset: number): number {
    let low = 0;
    let high = this.#ranges.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if ((this.#ranges[middle] as ByteRange).end < offset) low = middle + 1;
      else high = middle;
    }
    return low;
  }
}

/** How long ranges are together, bytes from `limit` on left out. */
export function bytesOf(ranges: readonly ByteRange[], limit: number): number {
  return ranges.reduce((sum, { start, end }) => sum + Math.max(0, Math.min(end, limit) - start), 0);
}
