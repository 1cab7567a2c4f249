/**
 * What a content security policy refuses. What fails by it looks like any other failure, but browsers tell of it
 * in an event of their own, a moment before or after.
 */

import { PhotoError } from './errors.js';

/** How long after a failure that event may come, in milliseconds. */
const LATE_MS = 50;

/** Scopes that hear of refusals: those of pages, by their document, and those of workers. */
type Hearer = Partial<Pick<EventTarget, 'addEventListener' | 'removeEventListener'>>;

/**
 * Does what a policy may refuse. Where it fails and a directive of that name was violated meanwhile, throws
 * `csp-…` in its place.
 */
export async function allowed<T>(
  work: () => Promise<T>,
  directive: RegExp,
  refusal: (violated: string, cause: unknown) => PhotoError,
  hearer: Hearer = globalThis.document ?? globalThis,
): Promise<T> {
  let violated: string | null = null;
  const hear = (event: Event) => {
    const { effectiveDirective } = event as SecurityPolicyViolationEvent;
    if (directive.test(effectiveDirective)) violated ??= effectiveDirective;
  };
  hearer.addEventListener?.('securitypolicyviolation', hear);
  try {
    return await work();
  } catch (thrown) {
    if (hearer.addEventListener && violated === null && !(thrown instanceof PhotoError)) {
      await new Promise((resolve) => setTimeout(resolve, LATE_MS));
    }
    throw violated === null ? thrown : refusal(violated, thrown);
  } finally {
    hearer.removeEventListener?.('securitypolicyviolation', hear);
  }
}
