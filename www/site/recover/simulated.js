/** Recovery of a simulated object, whose true transport is known. */

import { formatNumber, t } from './language.js';
import { recoverWith } from './recovery.js';
import { SimulationWorker } from './simulation.js';
import { tilesOf } from './tiles.js';

/** Photographs that are simulated; recoveries use the first of them. */
const MAX_PATTERNS = 160;
const SEED = 1;
/** Patterns of the recoveries that draw the whole plot. */
export const SWEEP_PATTERNS = [5, 10, 20, 40, 80, 160];

/**
 * @typedef {import('./types.js').Result} Result
 * @typedef {import('./types.js').Truth} Truth
 * @typedef {import('./types.js').ReportStage} ReportStage
 * @typedef {{ scene: string, size: string, ensemble: string, electrons: string, method: string, window: string, patterns: number }} Settings
 * @typedef {{ key: string, truth: Truth, correspondence: import('../../src/recover/types.js').Correspondence, photographs: Photographs }} PhotographedScene the key is that of everything the photographs depend on
 * @typedef {{ patterns: Float32Array[], photographs: Float32Array[], dark: Float32Array }} Photographs
 */

export class SimulatedObject {
  #form = /** @type {HTMLFormElement} */ (document.getElementById('simulated'));
  /** The scene that was photographed last. @type {PhotographedScene | undefined} */
  #scene;
  /** All scenes that are in memory. @type {Set<Truth>} */
  #truths = new Set();

  /** @param {{ onChange: () => void }} options called after each change by the visitor */
  constructor({ onChange }) {
    const form = this.#form;
    const output = /** @type {HTMLOutputElement} */ (form.querySelector('output'));
    const patterns = this.#control('patterns');
    patterns.addEventListener('input', () => {
      output.textContent = patterns.value;
    });
    form.addEventListener('submit', (event) => event.preventDefault());
    form.addEventListener('change', ({ target }) => {
      // As on the command line: the higher contrast of Bernoulli patterns helps sparse transport.
      if (target === this.#control('scene')) {
        const isGlass = this.#control('scene').value === 'stained-glass';
        this.#control('ensemble').value = isGlass ? 'gaussian' : 'bernoulli';
      }
      onChange();
    });
  }

  /** The number of patterns that the slider shows. @param {number} patterns */
  setPatterns(patterns) {
    const slider = this.#control('patterns');
    slider.value = String(patterns);
    slider.dispatchEvent(new Event('input'));
  }

  /** @returns {Settings} */
  settings() {
    const value = (/** @type {string} */ name) => this.#control(name).value;
    return {
      scene: value('scene'),
      size: value('size'),
      ensemble: value('ensemble'),
      electrons: value('electrons'),
      method: value('method'),
      window: value('window'),
      patterns: Number(value('patterns')),
    };
  }

  /** The settings that a line of the plot has in common, and their names. @param {Settings} settings */
  line({ patterns: _, ...settings }) {
    const options = ['scene', 'size', 'ensemble', 'electrons', 'method', 'window'].map((name) => {
      const select = /** @type {HTMLSelectElement} */ (this.#control(name));
      return { name, option: select.selectedOptions[0] };
    });
    return {
      key: JSON.stringify(settings),
      names: () =>
        options.map(({ name, option }) => {
          const text = option?.textContent ?? '';
          return name === 'electrons' || name === 'window'
            ? `${t(TITLES[name] ?? '')}: ${text}`
            : text;
        }),
    };
  }

  /**
   * Simulates scene and photographs unless they exist, recovers, and compares with the true transport.
   *
   * @param {Settings} settings
   * @param {{ signal: AbortSignal, report: ReportStage }} options
   * @returns {Promise<{ result: Result, snr: number }>}
   */
  async recover(settings, { signal, report }) {
    const scene = await this.#simulate(settings, signal, (share) =>
      report('job.simulating', share),
    );
    const side = Number(settings.size);
    const picture = (/** @type {number} */ side) => (/** @type {Float32Array} */ data) => ({
      width: side,
      height: side,
      data,
    });
    const { patterns, photographs, dark } = scene.photographs;
    const recovered = await recoverWith(
      {
        patterns: patterns.slice(0, settings.patterns).map(picture(side / 2)),
        photographs: photographs.slice(0, settings.patterns).map(picture(side)),
        dark: picture(side)(dark),
        correspondence: scene.correspondence,
        title: settings.scene === 'cookies' ? 'Simulated cookies' : 'Simulated stained glass',
      },
      settings,
      { signal, report },
    );
    try {
      const snr = await transportSnr(recovered, scene.truth);
      signal.throwIfAborted();
      const result = {
        recovered,
        truth: scene.truth,
        name: `simulated-${settings.scene}`,
        facts: () => [
          t('fact.patterns', { patterns: settings.patterns }),
          t('fact.snr', { snr: formatNumber(snr, 1) }),
        ],
      };
      return { result, snr };
    } catch (error) {
      recovered.free();
      throw error;
    }
  }

  /** Ends the workers of scenes that are not needed any more. @param {Truth | undefined} shown */
  keepOnly(shown) {
    for (const truth of this.#truths) {
      if (truth === shown || truth === this.#scene?.truth) continue;
      truth.worker.terminate();
      this.#truths.delete(truth);
    }
  }

  /**
   * The scene and its photographs, in a new worker if they changed: the last result may still be shown.
   *
   * @param {Settings} settings
   * @param {AbortSignal} signal
   * @param {(share: number) => void} report
   * @returns {Promise<PhotographedScene>}
   */
  async #simulate({ scene, size, ensemble, electrons }, signal, report) {
    const sceneKey = `${scene} ${size}`;
    const key = `${sceneKey} ${ensemble} ${electrons}`;
    if (this.#scene?.key === key) return this.#scene;
    signal.throwIfAborted();
    report(0);
    const worker = new SimulationWorker();
    const stop = () => worker.terminate();
    signal.addEventListener('abort', stop);
    try {
      const side = Number(size);
      const sides = { side, lightSide: side / 2 };
      const built = await worker.call('build', { scene, ...sides }, (share) => report(share / 2));
      const photographs = await worker.call(
        'photograph',
        { ensemble, count: MAX_PATTERNS, electrons: Number(electrons), seed: SEED },
        (share) => report(0.5 + share / 2),
      );
      const [a, b, c, d, e, f] = built.correspondence;
      const truth = { worker, key: sceneKey, window: built.window };
      this.#truths.add(truth);
      this.#scene = {
        key,
        truth,
        correspondence: [
          [a, b, c],
          [d, e, f],
        ],
        photographs,
      };
      return this.#scene;
    } catch (error) {
      worker.terminate();
      throw error;
    } finally {
      signal.removeEventListener('abort', stop);
    }
  }

  /** @param {string} name */
  #control(name) {
    return /** @type {HTMLInputElement | HTMLSelectElement} */ (
      this.#form.elements.namedItem(name)
    );
  }
}

/** SNR of the recovered transport against the true one. @param {Result['recovered']} recovered @param {Truth} truth */
async function transportSnr(recovered, truth) {
  let [signal, error] = [0, 0];
  for await (const tile of tilesOf(recovered)) {
    const sums = await truth.worker.call('tileError', { tile, window: recovered.window });
    signal += sums[0];
    error += sums[1];
  }
  return 10 * Math.log10(signal / error);
}

/** Titles of settings whose values do not speak for themselves. @type {Record<string, string>} */
const TITLES = { electrons: 'noise', window: 'window' };
