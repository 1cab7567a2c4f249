/** The structure of the recovered light transport matrix: its band and its singular values. */

import { formatNumber, onLanguageChange, t } from './language.js';
import { drawPlot, legend } from './line-plot.js';
import { drawHeat, largest } from './pictures.js';
import { SimulationWorker } from './simulation.js';
import { tilesOf } from './tiles.js';

/** The analysis waits for so long, as another recovery may follow at once. */
const DELAY_MS = 700;
/** Smallest singular value that is shown, relative to the largest. */
const MIN_RELATIVE_VALUE = 1e-4;

/** @typedef {import('./types.js').Result} Result */
/** @typedef {import('./simulation-worker.js').TileFunctions} TileFunctions */
/** @typedef {{ width: number, height: number, values: Float64Array }} SingularValues */

export class Structure {
  /** @type {SimulationWorker | undefined} */
  #worker;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #timer;
  /** @type {{ result: Result, recovered: SingularValues, truth: SingularValues | undefined } | undefined} */
  #shown;
  /** The true ones of the last scene. @type {{ key: string, values: SingularValues } | undefined} */
  #truth;
  #section = /** @type {HTMLElement} */ (document.getElementById('structure'));

  constructor() {
    onLanguageChange(() => this.#draw());
    addEventListener('resize', () => this.#draw());
  }

  /** Analyses a photograph soon; nothing ends the analysis. @param {Result | undefined} result */
  show(result) {
    clearTimeout(this.#timer);
    this.#stop();
    if (!result || result === this.#shown?.result) return;
    this.#timer = setTimeout(() => {
      const worker = new SimulationWorker();
      this.#worker = worker;
      this.#analyse(result, worker).catch((error) => {
        // A photograph that is no longer shown may have been freed meanwhile.
        if (worker !== this.#worker) return;
        // The page does without: photograph and light work.
        console.error('The structure of the light transport matrix was not analysed:', error);
        this.#stop();
        this.#shown = undefined;
        this.#draw();
      });
    }, DELAY_MS);
  }

  /** @param {Result} result @param {SimulationWorker} worker */
  async #analyse(result, worker) {
    const { recovered, truth } = result;
    const correspondence = Float64Array.from(recovered.correspondence.flat());
    const { width, height, lightWidth, lightHeight } = recovered;
    const size = { width, height, lightWidth, lightHeight, correspondence };
    await worker.call('analyse', { ...size, window: recovered.window });
    const rects = [];
    for await (const tile of tilesOf(recovered)) {
      const { x, y, width, height } = tile;
      rects.push({ x, y, width, height });
      await worker.call('addTile', tile);
    }
    const { cells, values } = await worker.call('band');
    if (worker !== this.#worker) return;
    const canvas = /** @type {HTMLCanvasElement} */ (document.getElementById('band'));
    // The square root shows faint elements too.
    drawHeat(
      canvas,
      { width: cells, height: cells },
      values.map(Math.sqrt),
      Math.sqrt(largest(values)),
    );
    const own = await worker.call('singularValues');
    if (truth && this.#truth?.key !== truth.key) {
      await worker.call('analyse', { ...size, window: truth.window });
      for (const rect of rects) {
        const values = await truth.worker.call('functions', rect);
        await worker.call('addTile', { ...rect, values });
      }
      this.#truth = { key: truth.key, values: await worker.call('singularValues') };
    }
    if (worker !== this.#worker) return;
    this.#stop();
    this.#shown = { result, recovered: own, truth: truth && this.#truth?.values };
    this.#draw();
  }

  #stop() {
    this.#worker?.terminate();
    this.#worker = undefined;
  }

  #draw() {
    this.#section.hidden = this.#shown === undefined;
    if (!this.#shown) return;
    const { result, recovered, truth } = this.#shown;
    const { width, height, lightWidth, lightHeight } = result.recovered;
    const band = /** @type {HTMLElement} */ (document.getElementById('band'));
    band.ariaLabel = t('band.label', {
      pixels: width * height,
      elements: lightWidth * lightHeight,
    });
    const isWhole = recovered.width === lightWidth && recovered.height === lightHeight;
    const block = /** @type {HTMLElement} */ (document.getElementById('singular-block'));
    block.textContent = t(isWhole ? 'singular.all' : 'singular.block', {
      width: recovered.width,
      height: recovered.height,
    });
    const lines = truth ? [recovered, truth] : [recovered];
    const relative = lines.map(({ values }) =>
      [...values].map((value) => value / (values[0] || 1)),
    );
    const [own = []] = relative;
    const percent = (/** @type {number | undefined} */ value) =>
      `${formatNumber(100 * (value ?? 0), 2)} %`;
    const container = /** @type {HTMLElement} */ (document.getElementById('singular-plot'));
    const plot = document.createElement('div');
    const names = truth ? ['light.recovered', 'light.true'] : ['light.recovered'];
    container.replaceChildren(legend(names.map((name) => t(name))), plot);
    drawPlot(plot, {
      label: t('singular.label', {
        middle: percent(own[Math.floor(own.length / 2)]),
        last: percent(own.at(-1)),
      }),
      x: {
        min: 1,
        max: own.length,
        ticks: [1, ...[1, 2, 3, 4].map((i) => Math.round((i * own.length) / 4))],
        label: t('singular.number'),
        format: (value) => formatNumber(value),
      },
      y: {
        min: MIN_RELATIVE_VALUE,
        max: 1,
        ticks: [1e-4, 1e-3, 1e-2, 0.1, 1],
        label: t('singular.axis'),
        isLogarithmic: true,
        format: (value) => formatNumber(value, Math.max(0, -Math.round(Math.log10(value)))),
      },
      series: relative.map((values) => ({ points: values.map((y, i) => ({ x: i + 1, y })) })),
    });
  }
}
