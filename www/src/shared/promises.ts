/** Additions to `Promise`, `AbortController` and `setTimeout`. */

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

/** When a wait for a promise ends early. */
export interface WaitLimits<T> {
  /** Once it is aborted, the wait rejects with its reason. */
  readonly signal?: AbortSignal;
  /** After this time, the result of `onTimeout` takes the promise's place. */
  readonly ms?: number;
  readonly onTimeout?: () => T | Promise<T>;
}

/** Waits for a promise until a signal is aborted or a time has passed. */
export function withTimeout<T>(
  promise: Promise<T>,
  { signal, ms, onTimeout }: WaitLimits<T>,
): Promise<T> {
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
