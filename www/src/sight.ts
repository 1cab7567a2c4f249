/** Which elements can be seen: on the page's screen or near it, and not hidden. */

/** Pixels around the screen: what comes into view is drawn just before it does. */
const MARGIN = '64px';

const watched = new Map<Element, (seen: boolean) => void>();
let observer: IntersectionObserver | undefined;

/** Tells once soon, and then whenever it changes. Nothing is told where browsers cannot tell. */
export function watch(element: Element, tell: (seen: boolean) => void): void {
  if (watched.has(element) || !globalThis.IntersectionObserver) return;
  // One for all: elements that come into view together are told of together.
  observer ??= new IntersectionObserver(
    (entries) => {
      for (const { target, isIntersecting } of entries) watched.get(target)?.(isIntersecting);
    },
    { rootMargin: MARGIN },
  );
  watched.set(element, tell);
  observer.observe(element);
}

export function unwatch(element: Element): void {
  if (watched.delete(element)) observer?.unobserve(element);
}
