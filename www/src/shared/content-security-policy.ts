/**
 * Recognises failures that are due to the page's content security policy. Such a failure looks like any other, but the
 * browser also fires a `securitypolicyviolation` event shortly before or after it.
 */

import { PhotoError } from './errors.js';

/** How long after the failure the event may come, in milliseconds. */
const MAX_EVENT_DELAY_MS = 50;

/** Where the event is fired: the document of a page, or the global scope of a worker. */
type ViolationEventTarget = Partial<Pick<EventTarget, 'addEventListener' | 'removeEventListener'>>;

/** Does some work. If it fails, and a directive that matches `directive` was violated meanwhile, `toError` says why. */
export async function withPolicyErrors<T>(
  work: () => Promise<T>,
  directive: RegExp,
  toError: (violated: string, cause: unknown) => PhotoError,
  target: ViolationEventTarget = globalThis.document ?? globalThis,
): Promise<T> {
  let violated: string | null = null;
  const onViolation = (event: Event) => {
    const { effectiveDirective } = event as SecurityPolicyViolationEvent;
    if (directive.test(effectiveDirective)) violated ??= effectiveDirective;
  };
  target.addEventListener?.('securitypolicyviolation', onViolation);
  try {
    return await work();
  } catch (thrown) {
    if (target.addEventListener && violated === null && !(thrown instanceof PhotoError)) {
      await new Promise((resolve) => setTimeout(resolve, MAX_EVENT_DELAY_MS));
    }
    throw violated === null ? thrown : toError(violated, thrown);
  } finally {
    target.removeEventListener?.('securitypolicyviolation', onViolation);
  }
}
