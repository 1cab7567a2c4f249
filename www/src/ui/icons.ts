/** Line icons on a grid of 24 × 24. */

const SVG_NAMESPACE = 'http://www.w3.org/2000/svg';

export const LIGHT_ICON =
  'M12 8a4 4 0 1 0 0 8a4 4 0 1 0 0-8M12 2.5v2M12 19.5v2M2.5 12h2M19.5 12h2M5.3 5.3l1.4 1.4' +
  'M17.3 17.3l1.4 1.4M5.3 18.7l1.4-1.4M17.3 6.7l1.4-1.4';

/** An icon that screen readers skip. `path` is SVG path data. */
export function createIcon(path: string): SVGElement {
  const svg = document.createElementNS(SVG_NAMESPACE, 'svg');
  svg.setAttribute('viewBox', '0 0 24 24');
  svg.setAttribute('aria-hidden', 'true');
  svg.append(document.createElementNS(SVG_NAMESPACE, 'path'));
  setIcon(svg, path);
  return svg;
}

export function setIcon(svg: Element, path: string): void {
  svg.firstElementChild?.setAttribute('d', path);
}
