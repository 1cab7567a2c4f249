/** When to send a failed request again. */

import { withTimeout } from '../shared/promises.js';
import type { RetryableError } from './http-errors.js';

const FIRST_PAUSE_MS = 250;
const MAX_PAUSE_MS = 8_000;
/** A server's Retry-After is respected up to this limit. */
const MAX_RETRY_AFTER_MS = 30_000;

export interface RetryPorts {
  /** At least 0, less than 1. */
  readonly random: () => number;
  /** Milliseconds since 1970. */
  readonly now: () => number;
}

/** The pause after the nth failure in a row: exponential backoff, with jitter lest all pages return at once. */
export function retryPauseMs(error: RetryableError, failures: number, ports: RetryPorts): number {
  const backoff = Math.min(MAX_PAUSE_MS, FIRST_PAUSE_MS * 2 ** (failures - 1));
  const requested = Math.min(MAX_RETRY_AFTER_MS, retryAfterMs(error.retryAfter, ports.now()));
  return Math.max(requested, (backoff * (1 + ports.random())) / 2);
}

/** Retry-After has seconds or a date. */
function retryAfterMs(header: string | null, now: number): number {
  if (header === null) return 0;
  if (/^\s*\d+\s*$/.test(header)) return Number(header) * 1000;
  const date = Date.parse(header);
  return Number.isNaN(date) ? 0 : date - now;
}

export function sleep(ms: number, signal: AbortSignal): Promise<void> {
  return withTimeout(new Promise(() => {}), { signal, ms, onTimeout: () => {} });
}
