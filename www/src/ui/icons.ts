/** Line icons, on a grid of 24. */

const SVG = 'http://www.w3.org/2000/svg';

/** A lamp and its rays. */
export const LAMP =
  'M12 8a4 4 0 1 0 0 8a4 4 0 1 0 0-8M12 2.5v2M12 19.5v2M2.5 12h2M19.5 12h2M5.3 5.3l1.4 1.4' +
  'M17.3 17.3l1.4 1.4M5.3 18.7l1.4-1.4M17.3 6.7l1.4-1.4';

/** An icon of a path, which is read out as nothing. */
export function icon(path: string): SVGElement {
  const svg = document.createElementNS(SVG, 'svg');
  svg.setAttribute('viewBox', '0 0 24 24');
  svg.setAttribute('aria-hidden', 'true');
  svg.append(document.createElementNS(SVG, 'path'));
  showIcon(svg, path);
  return svg;
}

/** Makes another of it. */
export function showIcon(svg: Element, path: string): void {
  svg.firstElementChild?.setAttribute('d', path);
}
