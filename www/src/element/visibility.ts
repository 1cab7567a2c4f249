/** Observes whether elements are in the viewport or near it. All elements share two observers, which report together. */

import type { RevealState } from '../state/reveal.js';

/** The fields of the reveal state that this module observes. */
export type Visibility = keyof Pick<RevealState, 'isNear' | 'isVisible'>;

type VisibilityCallback = (visibility: Visibility, isTrue: boolean) => void;

/** How far outside of the viewport counts: drawing begins shortly before an element becomes visible. */
const ROOT_MARGINS: readonly (readonly [Visibility, string])[] = [
  ['isVisible', '64px'],
  ['isNear', '100%'],
];

const callbacks = new Map<Element, VisibilityCallback>();
let observers: readonly IntersectionObserver[] | undefined;

/** Calls back soon for the first time, and then at each change. Without browser support, all elements are visible. */
export function observeVisibility(element: Element, callback: VisibilityCallback): void {
  if (callbacks.has(element)) return;
  callbacks.set(element, callback);
  if (!globalThis.IntersectionObserver) {
    for (const [visibility] of ROOT_MARGINS) callback(visibility, true);
    return;
  }
  observers ??= ROOT_MARGINS.map(createObserver);
  for (const observer of observers) observer.observe(element);
}

export function unobserveVisibility(element: Element): void {
  if (!callbacks.delete(element)) return;
  for (const observer of observers ?? []) observer.unobserve(element);
}

function createObserver([visibility, rootMargin]: readonly [Visibility, string]) {
  const report = (entries: readonly IntersectionObserverEntry[]) => {
    for (const entry of entries) callbacks.get(entry.target)?.(visibility, entry.isIntersecting);
  };
  return new IntersectionObserver(report, { rootMargin });
}
