/** The order in which backends are tried. */

import type { Backend } from '../engine/wasm-exports.js';
import { endSentence, hasCode, messageOf, PhotoError } from '../shared/errors.js';

export const BACKEND_TITLES: Readonly<Record<Backend, string>> = {
  webgpu: 'WebGPU',
  webgl2: 'WebGL2',
  cpu: 'CPU',
};

/**
 * Calls `attempt` for one backend after another until one succeeds; `reason` says why those before it failed. Rejects
 * with `backend-unavailable` and every reason if no backend works, with `csp-wasm` at once, since that holds for all of
 * them, and with the signal's reason after a failure if it is aborted.
 */
export async function firstWorking<T>(
  backends: readonly Backend[],
  attempt: (backend: Backend) => Promise<T>,
  signal: AbortSignal,
): Promise<{ readonly value: T; readonly reason: string }> {
  const failures: string[] = [];
  let cause: unknown;
  for (const backend of backends) {
    try {
      return { value: await attempt(backend), reason: failures.join(' ') };
    } catch (thrown) {
      signal.throwIfAborted();
      if (hasCode(thrown, 'csp-wasm')) throw thrown;
      cause = thrown;
      failures.push(`${BACKEND_TITLES[backend]}: ${endSentence(messageOf(thrown))}`);
    }
  }
  const remedy = 'Remove the backend attribute, so that the CPU is tried too.';
  if (!backends.includes('cpu')) failures.push(remedy);
  const message = `This browser cannot draw the photograph. ${failures.join(' ')}`;
  throw new PhotoError('backend-unavailable', message, cause);
}
