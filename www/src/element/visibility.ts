/** Observes whether an element is in the viewport or near it. */

import type { RevealState } from '../state/reveal.js';

export type VisibilityFlag = keyof Pick<RevealState, 'isNear' | 'isVisible'>;

/** How far outside of the viewport counts: drawing begins shortly before an element becomes visible. */
const ROOT_MARGINS = { isVisible: '64px', isNear: '100%' } as const;

/** Calls back soon, and then at each change, until `signal` is aborted. Without support, all elements are visible. */
export function observeVisibility(
  element: Element,
  callback: (visibility: VisibilityFlag, isTrue: boolean) => void,
  signal: AbortSignal,
): void {
  for (const visibility of ['isVisible', 'isNear'] as const) {
    if (!globalThis.IntersectionObserver) {
      callback(visibility, true);
      continue;
    }
    const report = (entries: readonly IntersectionObserverEntry[]) => {
      const last = entries.at(-1);
      // The browser may report changes from before `disconnect` after it.
      if (last && !signal.aborted) callback(visibility, last.isIntersecting);
    };
    const observer = new IntersectionObserver(report, { rootMargin: ROOT_MARGINS[visibility] });
    observer.observe(element);
    signal.addEventListener('abort', () => observer.disconnect());
  }
}
