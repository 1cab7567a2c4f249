/** An element on the whole screen. */

export function isFullscreen(element: Element): boolean {
  return element.matches(':fullscreen');
}

/** Takes the whole screen, or leaves it. Refused where the page's own frame, or the visitor, does not allow it. */
export function toggleFullscreen(element: Element): void {
  const done = isFullscreen(element) ? document.exitFullscreen() : element.requestFullscreen();
  void done.catch(() => {});
}
