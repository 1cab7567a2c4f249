/** Which elements can be seen: on the page's screen or near it, and not hidden. */

/**
 * How far around the screen counts: what comes into view is drawn just before it does, and may be fetched
 * once it is within a screen of it.
 */
const MARGINS = { seen: '64px', near: '100%' } as const;

export type Sight = keyof typeof MARGINS;

type Tell = (sight: Sight, is: boolean) => void;

const watched = new Map<Element, Tell>();
let observers: readonly [Sight, IntersectionObserver][] | undefined;

/** Tells of either once soon, and then whenever it changes. Where browsers cannot tell, it is so at once. */
export function watch(element: Element, tell: Tell): void {
  if (watched.has(element)) return;
  watched.set(element, tell);
  if (!globalThis.IntersectionObserver) {
    for (const sight of ['near', 'seen'] as const) tell(sight, true);
    return;
  }
  observers ??= Object.entries(MARGINS).map(([name, margin]) => [
    name as Sight,
    observer(name as Sight, margin),
  ]);
  for (const [, observer] of observers) observer.observe(element);
}

export function unwatch(element: Element): void {
  if (!watched.delete(element)) return;
  for (const [, observer] of observers ?? []) observer.unobserve(element);
}

/** One for all: elements that come into view together are told of together. */
function observer(sight: Sight, rootMargin: string): IntersectionObserver {
  return new IntersectionObserver(
    (entries) => {
      for (const { target, isIntersecting } of entries)
        watched.get(target)?.(sight, isIntersecting);
    },
    { rootMargin },
  );
}
