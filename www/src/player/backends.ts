/** Which back end draws: the first of an order that can. */

import type { Backend } from '../engine/types.js';
import { messageOf, PhotoError, toPhotoError } from '../shared/errors.js';

/** How people call the back ends. */
export const BACKEND_TITLES: Readonly<Record<Backend, string>> = {
  webgpu: 'WebGPU',
  webgl2: 'WebGL2',
  cpu: 'CPU',
};

/** A back end that works, and why the ones before it do not. */
export interface Chosen<T> {
  readonly backend: Backend;
  readonly value: T;
  /** Empty where the first choice worked. */
  readonly reason: string;
}

/**
 * Tries back ends in order. `attempt` is called for one after the other and never for two at once;
 * `abandoned` says between attempts whether the result is still wanted, and its throw ends the
 * search. Where none works, throws `backend-unavailable` with every reason.
 */
export async function firstWorking<T>(
  order: readonly Backend[],
  attempt: (backend: Backend) => Promise<T>,
  abandoned: () => void,
): Promise<Chosen<T>> {
  const failures: string[] = [];
  let last: unknown;
  for (const backend of order) {
    try {
      const value = await attempt(backend);
      return { backend, value, reason: failures.join(' ') };
    } catch (thrown) {
      abandoned();
      // Nor would any other be allowed to.
      if (toPhotoError(thrown).code === 'csp-wasm') throw thrown;
      last = thrown;
      failures.push(`${BACKEND_TITLES[backend]}: ${sentence(messageOf(thrown))}`);
    }
  }
  const remedy = order.includes('cpu') ? '' : ' The CPU might: leave the backend attribute out.';
  throw new PhotoError(
    'backend-unavailable',
    `This browser cannot draw the photograph. ${failures.join(' ')}${remedy}`,
    last,
  );
}

/** What is left to try when a back end does not come to draw. */
export function after(order: readonly Backend[], failed: Backend): readonly Backend[] {
  return order.slice(order.indexOf(failed) + 1);
}

/** What is left to try when a back end was lost while drawing: that one first. */
export function from(order: readonly Backend[], lost: Backend): readonly Backend[] {
  return order.slice(order.indexOf(lost));
}

/** With an end to it. */
export function sentence(text: string): string {
  return /[.!?]$/.test(text) ? text : `${text}.`;
}
