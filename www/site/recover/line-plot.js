/** A line plot as SVG, as wide as its container. */

const NAMESPACE = 'http://www.w3.org/2000/svg';
const MARGIN = { left: 40, right: 16, top: 14, bottom: 48 };
/** Width of a digit. */
const DIGIT_WIDTH = 8;
const HEIGHT = 300;
const MIN_WIDTH = 260;
const MAX_WIDTH = 760;
/** Series beyond these repeat a style. */
const SERIES_STYLES = 5;

/** @typedef {{ min: number, max: number, ticks: number[], label: string, isLogarithmic?: boolean, format: (value: number) => string }} Axis */
/** @typedef {{ points: { x: number, y: number }[], hasMarkers?: boolean }} Series */
/** @typedef {{ label: string, x: Axis, y: Axis, series: Series[] }} Plot */

/** Draws a plot into a container, in place of the last. @param {HTMLElement} container @param {Plot} plot */
export function drawPlot(container, { label, x, y, series }) {
  const width = Math.max(MIN_WIDTH, Math.min(MAX_WIDTH, container.clientWidth || MAX_WIDTH));
  const longest = Math.max(...y.ticks.map((value) => y.format(value).length));
  const [left, right] = [MARGIN.left + DIGIT_WIDTH * longest, width - MARGIN.right];
  const [top, bottom] = [MARGIN.top, HEIGHT - MARGIN.bottom];
  const at = {
    x: (/** @type {number} */ value) => left + share(x, value) * (right - left),
    y: (/** @type {number} */ value) => bottom - share(y, value) * (bottom - top),
  };
  const svg = element('svg', { viewBox: `0 0 ${width} ${HEIGHT}`, role: 'img' });
  svg.setAttribute('aria-label', label);
  for (const value of y.ticks) {
    const height = at.y(value);
    svg.append(
      element('line', { class: 'grid', x1: left, x2: right, y1: height, y2: height }),
      text(y.format(value), { x: left - 8, y: height + 5, 'text-anchor': 'end' }),
    );
  }
  for (const value of x.ticks) {
    svg.append(
      element('line', { class: 'grid', x1: at.x(value), x2: at.x(value), y1: top, y2: bottom }),
      text(x.format(value), { x: at.x(value), y: bottom + 20, 'text-anchor': 'middle' }),
    );
  }
  svg.append(
    text(x.label, { class: 'axis', x: (left + right) / 2, y: HEIGHT - 6, 'text-anchor': 'middle' }),
    text(y.label, {
      class: 'axis',
      'text-anchor': 'middle',
      transform: `translate(13 ${(top + bottom) / 2}) rotate(-90)`,
    }),
  );
  for (const [i, { points, hasMarkers }] of series.entries()) {
    const style = `series-${i % SERIES_STYLES}`;
    const places = points.map(({ x, y }) => `${at.x(x).toFixed(1)},${at.y(y).toFixed(1)}`);
    svg.append(element('polyline', { class: style, points: places.join(' ') }));
    for (const point of hasMarkers ? points : []) {
      svg.append(element('circle', { class: style, cx: at.x(point.x), cy: at.y(point.y), r: 4 }));
    }
  }
  container.replaceChildren(svg);
}

/** The names of the series, in their styles. @param {string[]} labels */
export function legend(labels) {
  const list = document.createElement('ul');
  list.className = 'legend';
  for (const [i, label] of labels.entries()) {
    const item = document.createElement('li');
    item.className = `series-${i % SERIES_STYLES}`;
    item.textContent = label;
    list.append(item);
  }
  return list;
}

/** Round values from at most `min` to at least `max`, at most eight. @param {number} min @param {number} max */
export function roundTicks(min, max) {
  const step = [1, 2, 5, 10, 20, 50].find((step) => (max - min) / step <= 6) ?? 100;
  const first = Math.floor(min / step);
  return Array.from({ length: Math.ceil(max / step) - first + 1 }, (_, i) => (first + i) * step);
}

/** @param {string} name @param {Record<string, string | number>} attributes */
export function element(name, attributes) {
  const created = document.createElementNS(NAMESPACE, name);
  for (const [key, value] of Object.entries(attributes)) created.setAttribute(key, String(value));
  return created;
}

/** @param {string} content @param {Record<string, string | number>} attributes */
function text(content, attributes) {
  const created = element('text', attributes);
  created.textContent = content;
  return created;
}

/** The place of a value along an axis, 0 to 1. @param {Axis} axis @param {number} value */
function share({ min, max, isLogarithmic }, value) {
  if (!isLogarithmic) return (value - min) / (max - min);
  return Math.log(Math.max(value, min) / min) / Math.log(max / min);
}
