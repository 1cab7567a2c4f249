/** SNR by the number of patterns: one line for each choice of settings, a point for each recovery. */

import { formatNumber, onLanguageChange, t } from './language.js';
import { drawPlot, legend, roundTicks } from './line-plot.js';

const PATTERN_TICKS = [5, 10, 20, 40, 80, 160];

/** @typedef {{ key: string, names: () => string[], points: Map<number, number> }} Line the names of its settings; SNR by patterns */

export class SnrPlot {
  /** @type {Map<string, Line>} */
  #lines = new Map();
  #section = /** @type {HTMLElement} */ (document.getElementById('accuracy'));
  #plot = /** @type {HTMLElement} */ (document.getElementById('snr-plot'));
  #table = /** @type {HTMLElement} */ (document.getElementById('snr-table'));

  constructor() {
    onLanguageChange(() => this.#draw());
    addEventListener('resize', () => this.#draw());
  }

  /**
   * Adds a recovery.
   *
   * @param {string} key of its settings
   * @param {() => string[]} names of its settings, in the page's language
   * @param {number} patterns
   * @param {number} snr
   */
  add(key, names, patterns, snr) {
    const line = this.#lines.get(key) ?? { key, names, points: new Map() };
    this.#lines.set(key, line);
    line.points.set(patterns, snr);
    this.#draw();
  }

  #draw() {
    const lines = [...this.#lines.values()];
    this.#section.hidden = lines.length === 0;
    if (lines.length === 0) return;
    const series = lines.map(({ points }) => ({
      points: [...points].sort(([a], [b]) => a - b).map(([x, y]) => ({ x, y })),
      hasMarkers: true,
    }));
    const all = series.flatMap(({ points }) => points);
    const values = all.map(({ y }) => y);
    // Room above the highest point.
    const ticks = roundTicks(Math.min(0, ...values), Math.max(10, ...values.map((y) => y + 1)));
    const points = series.at(-1)?.points ?? [];
    const described = points.map(({ x, y }) =>
      t('snr.point', { patterns: x, snr: formatNumber(y, 1) }),
    );
    const plot = document.createElement('div');
    const labels = this.#labels(lines);
    this.#plot.replaceChildren(...(lines.length > 1 ? [legend(labels)] : []), plot);
    drawPlot(plot, {
      label: t('snr.label', { points: described.join(', ') }),
      x: {
        min: 5,
        max: 160,
        ticks: PATTERN_TICKS,
        label: t('patterns'),
        isLogarithmic: true,
        format: (value) => formatNumber(value),
      },
      y: {
        min: ticks[0] ?? 0,
        max: ticks.at(-1) ?? 10,
        ticks,
        label: t('snr.axis'),
        format: (value) => formatNumber(value),
      },
      series,
    });
    this.#table.replaceChildren(table(lines, labels));
  }

  /** The settings in which a line differs from others. @param {Line[]} lines */
  #labels(lines) {
    const names = lines.map((line) => line.names());
    return names.map((own) =>
      own.filter((name, i) => names.some((other) => other[i] !== name)).join(', '),
    );
  }
}

/** @param {Line[]} lines @param {string[]} labels */
function table(lines, labels) {
  const created = document.createElement('table');
  const head = created.createTHead().insertRow();
  for (const title of [t('patterns'), ...labels.map((label) => `${label} SNR`.trim())]) {
    const cell = document.createElement('th');
    cell.scope = 'col';
    cell.textContent = title;
    head.append(cell);
  }
  const counts = new Set(lines.flatMap(({ points }) => [...points.keys()]));
  const body = created.createTBody();
  for (const count of [...counts].sort((a, b) => a - b)) {
    const row = body.insertRow();
    row.insertCell().textContent = formatNumber(count);
    for (const { points } of lines) {
      const snr = points.get(count);
      row.insertCell().textContent = snr === undefined ? '' : `${formatNumber(snr, 1)} dB`;
    }
  }
  return created;
}
