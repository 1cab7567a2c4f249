/** Observes whether an element is in the viewport or near it, and measures how far it is from its middle. */

import { OUT_OF_VIEW, type Placement } from '../photo/load-queue.js';
import type { RevealState } from '../state/reveal.js';

export type VisibilityFlag = keyof Pick<RevealState, 'isNear' | 'isVisible'>;

/** How far outside of the viewport counts: drawing begins shortly before an element becomes visible. */
const ROOT_MARGINS = { isVisible: '64px', isNear: '100%' } as const;

/**
 * Calls back soon, and then at each change, until `signal` is aborted. Without support and in print, all elements are
 * visible.
 */
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
    let isIntersecting = false;
    const report = (entries: readonly IntersectionObserverEntry[]) => {
      isIntersecting = entries.at(-1)?.isIntersecting ?? isIntersecting;
      // The browser may report changes from before `disconnect` after it.
      if (!signal.aborted) callback(visibility, isIntersecting);
    };
    const observer = new IntersectionObserver(report, { rootMargin: ROOT_MARGINS[visibility] });
    observer.observe(element);
    signal.addEventListener('abort', () => observer.disconnect());
    // Paper shows what is below the viewport as well, unless it is not rendered.
    const isPrinted = () => element.getClientRects().length > 0;
    addEventListener('beforeprint', () => callback(visibility, isPrinted()), { signal });
    addEventListener('afterprint', () => callback(visibility, isIntersecting), { signal });
  }
}

export function placementOf(element: Element): Placement {
  const [box] = element.getClientRects();
  // It is not rendered.
  if (!box) return 2 * OUT_OF_VIEW;
  const [middleX, middleY] = [innerWidth / 2, innerHeight / 2];
  const x = Math.max(box.left - middleX, middleX - box.right, 0);
  const y = Math.max(box.top - middleY, middleY - box.bottom, 0);
  const isInView = x < middleX && y < middleY;
  return Math.hypot(x, y) + (isInView ? 0 : OUT_OF_VIEW);
}
