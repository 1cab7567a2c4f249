export function isFullscreen(element: Element): boolean {
  return element.matches(':fullscreen');
}

/** Does nothing where the browser, an enclosing frame or the visitor refuses. */
export function toggleFullscreen(element: Element): void {
  const change = isFullscreen(element) ? document.exitFullscreen() : element.requestFullscreen();
  void change.catch(() => {});
}
