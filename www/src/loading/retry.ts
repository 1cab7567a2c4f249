/** Waiting for a server, and when to ask it again. */

import type { Passing } from './http-errors.js';

const FIRST_PAUSE_MS = 250;
const LONGEST_PAUSE_MS = 8_000;
/** A server may ask for more patience than this page has, but not for any amount. */
const LONGEST_RETRY_AFTER_MS = 30_000;

export interface ChancePorts {
  /** At least 0, less than 1. */
  readonly random: () => number;
  /** Milliseconds since 1970. */
  readonly now: () => number;
}

/**
 * How long to wait after the nth failure in a row. Half of it is left to chance, lest all the pages
 * that a server's fault has cut off come back at the same moment.
 */
export function pauseMs(failure: Passing, failures: number, ports: ChancePorts): number {
  const longest = Math.min(LONGEST_PAUSE_MS, FIRST_PAUSE_MS * 2 ** (failures - 1));
  const asked = Math.min(LONGEST_RETRY_AFTER_MS, retryAfterMs(failure.retryAfter, ports.now()));
  return Math.max(asked, (longest * (1 + ports.random())) / 2);
}

/** Retry-After says seconds or a date. */
function retryAfterMs(header: string | null, now: number): number {
  if (header === null) return 0;
  if (/^\s*\d+\s*$/.test(header)) return Number(header) * 1000;
  const date = Date.parse(header);
  return Number.isNaN(date) ? 0 : date - now;
}

/** Waits, and rejects with the signal's reason once aborted. */
export function sleep(ms: number, signal: AbortSignal): Promise<void> {
  return within(new Promise(() => {}), signal, { ms, end: () => {} });
}

/** Waits for a promise no longer than the signal allows, and no longer than `limit` says, whose `end`
 * then takes the promise's place. Rejects with the signal's reason once aborted. */
export function within<T>(
  promise: Promise<T>,
  signal: AbortSignal,
  limit?: { readonly ms: number; readonly end: () => T | Promise<T> },
): Promise<T> {
  let timer: ReturnType<typeof setTimeout> | undefined;
  let onAbort = () => {};
  return new Promise<T>((resolve, reject) => {
    onAbort = () => reject(signal.reason);
    if (signal.aborted) onAbort();
    signal.addEventListener('abort', onAbort);
    if (limit) timer = setTimeout(() => resolve(limit.end()), limit.ms);
    promise.then(resolve, reject);
  }).finally(() => {
    clearTimeout(timer);
    signal.removeEventListener('abort', onAbort);
  });
}
