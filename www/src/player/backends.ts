/** The order in which backends are tried. */

import type { Backend } from '../engine/types.js';
import { endSentence, hasCode, messageOf, PhotoError } from '../shared/errors.js';

/** The backends' names in messages. */
export const BACKEND_TITLES: Readonly<Record<Backend, string>> = {
  webgpu: 'WebGPU',
  webgl2: 'WebGL2',
  cpu: 'CPU',
};

/** The first backend that works. */
export interface WorkingBackend<T> {
  readonly backend: Backend;
  readonly value: T;
  /** Why those before it do not work; empty if it was the first. */
  readonly reason: string;
}

/**
 * Calls `attempt` for one backend after another until one succeeds. After each failure it calls
 * `checkCancelled`, which throws to end the search. Rejects with `backend-unavailable` and every reason
 * if no backend works, or with `csp-wasm` at once, since that holds for all of them.
 */
export async function firstWorking<T>(
  backends: readonly Backend[],
  attempt: (backend: Backend) => Promise<T>,
  checkCancelled: () => void,
): Promise<WorkingBackend<T>> {
  const failures: string[] = [];
  let cause: unknown;
  for (const backend of backends) {
    try {
      const value = await attempt(backend);
      return { backend, value, reason: failures.join(' ') };
    } catch (thrown) {
      checkCancelled();
      if (hasCode(thrown, 'csp-wasm')) throw thrown;
      cause = thrown;
      failures.push(`${BACKEND_TITLES[backend]}: ${endSentence(messageOf(thrown))}`);
    }
  }
  const remedy = backends.includes('cpu')
    ? ''
    : ' Remove the backend attribute, so that the CPU is tried too.';
  throw new PhotoError(
    'backend-unavailable',
    `This browser cannot draw the photograph. ${failures.join(' ')}${remedy}`,
    cause,
  );
}

/** The backends left after one that cannot be used. */
export function backendsAfter(backends: readonly Backend[], failed: Backend): readonly Backend[] {
  return backends.slice(backends.indexOf(failed) + 1);
}

/** The backends left after one that worked and was lost: the same one is tried again first. */
export function backendsFrom(backends: readonly Backend[], lost: Backend): readonly Backend[] {
  return backends.slice(backends.indexOf(lost));
}
