/** Additions to `Promise`. */

/** As `Promise.all`, but rejects only after every promise has settled. */
export async function allSettledOrThrow<T>(promises: readonly Promise<T>[]): Promise<T[]> {
  const results = await Promise.allSettled(promises);
  return results.map((result) => {
    if (result.status === 'rejected') throw result.reason;
    return result.value;
  });
}

/** A promise with its resolver. */
export class Deferred {
  resolve = (): void => {};
  readonly promise = new Promise<void>((resolve) => {
    this.resolve = resolve;
  });
}

/** How long to wait for a promise. */
export interface WaitLimits<T> {
  /** The wait rejects with this signal's reason once it is aborted. */
  readonly signal?: AbortSignal;
  /** After `ms` milliseconds, the result of `onTimeout` takes the promise's place. */
  readonly timeout?: { readonly ms: number; readonly onTimeout: () => T | Promise<T> };
}

/** Waits for a promise until a signal is aborted or a time has passed. */
export function withTimeout<T>(
  promise: Promise<T>,
  { signal, timeout }: WaitLimits<T>,
): Promise<T> {
  let timer: ReturnType<typeof setTimeout> | undefined;
  let onAbort = () => {};
  return new Promise<T>((resolve, reject) => {
    onAbort = () => reject(signal?.reason);
    if (signal?.aborted) onAbort();
    signal?.addEventListener('abort', onAbort);
    if (timeout) timer = setTimeout(() => resolve(timeout.onTimeout()), timeout.ms);
    promise.then(resolve, reject);
  }).finally(() => {
    clearTimeout(timer);
    signal?.removeEventListener('abort', onAbort);
  });
}
