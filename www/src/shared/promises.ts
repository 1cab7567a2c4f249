/** Additions to `Promise`, `AbortController` and `setTimeout`. */

/** As `Promise.all`, but rejects only after every promise has settled. */
export async function allSettledOrThrow<T>(promises: readonly Promise<T>[]): Promise<T[]> {
  const results = await Promise.allSettled(promises);
  return results.map((result) => {
    if (result.status === 'rejected') throw result.reason;
    return result.value;
  });
}

export class Deferred<T = void> {
  resolve: (value: T) => void = () => {};
  reject: (error: unknown) => void = () => {};
  readonly promise = new Promise<T>((resolve, reject) => {
    this.resolve = resolve;
    this.reject = reject;
  });
}

/** Calls back once after `ms` milliseconds. The returned function cancels. */
export function callLater(ms: number, callback: () => void): () => void {
  const timer = setTimeout(callback, ms);
  return () => clearTimeout(timer);
}

/** A controller that is aborted with a signal as well. Abort it in the end, which removes its listener. */
export function linkedController(signal: AbortSignal): AbortController {
  const linked = new AbortController();
  signal.addEventListener('abort', () => linked.abort(signal.reason), { signal: linked.signal });
  return linked;
}

/** Rejects with the signal's reason once it is aborted; after `ms` milliseconds, `onTimeout` gives the result. */
export function withTimeout<T>(
  promise: Promise<T>,
  limits: { signal?: AbortSignal; ms?: number; onTimeout?: () => T | Promise<T> },
): Promise<T> {
  const { signal, ms, onTimeout } = limits;
  let timer: ReturnType<typeof setTimeout> | undefined;
  let onAbort = () => {};
  return new Promise<T>((resolve, reject) => {
    onAbort = () => reject(signal?.reason);
    if (signal?.aborted) onAbort();
    signal?.addEventListener('abort', onAbort);
    if (onTimeout) timer = setTimeout(() => resolve(onTimeout()), ms);
    promise.then(resolve, reject);
  }).finally(() => {
    clearTimeout(timer);
    signal?.removeEventListener('abort', onAbort);
  });
}
