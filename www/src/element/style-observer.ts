/** Observes how the page styles an element. */

/** Calls back when the computed style may have changed: media queries and containers change it with the size. */
export function observeStyle(element: Element, callback: () => void, signal: AbortSignal): void {
  const resizes = new ResizeObserver(callback);
  resizes.observe(element);
  const mutations = new MutationObserver(callback);
  mutations.observe(element, { attributeFilter: ['class', 'style'] });
  signal.addEventListener('abort', () => {
    resizes.disconnect();
    mutations.disconnect();
  });
}
