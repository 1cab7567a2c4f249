/** The recovered photograph under a light that the visitor moves, and the functions at the light's centre. */

import { formatNumber, onLanguageChange, t } from './language.js';
import { element as svgElement } from './line-plot.js';
import { newestOnly } from './newest-only.js';
import { difference, drawHeat, drawPicture, largest, snr } from './pictures.js';
import { cameraPixel, lightElement, singleElement, spotLight } from './spot-light.js';

/** Differences are shown brighter than the pictures by this factor. */
const DIFFERENCE_GAIN = 10;
/** Texts follow the light after it has rested for so long. */
const REST_MS = 400;
/** Share of the light that the text counts elements for. */
const TEXT_SHARE = 0.9;

/** @typedef {import('./types.js').Result} Result */
/** @typedef {import('./spot-light.js').Point} Point */

const canvas = (/** @type {string} */ id) =>
  /** @type {HTMLCanvasElement} */ (document.getElementById(id));

export class Viewer {
  /** @type {Result | undefined} */
  #result;
  /** @type {Point} */
  #point = { x: 0.5, y: 0.5, size: 0.16 };
  /** Value that is shown as white. */
  #white = 1;
  #pictureSnr = Number.NaN;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #restTimer;
  #section = /** @type {HTMLElement} */ (document.getElementById('result'));
  #text = /** @type {HTMLElement} */ (document.getElementById('point-text'));
  #sliders = {
    x: /** @type {HTMLInputElement} */ (document.getElementById('point-x')),
    y: /** @type {HTMLInputElement} */ (document.getElementById('point-y')),
    size: /** @type {HTMLInputElement} */ (document.getElementById('point-size')),
  };
  #drawPictures;
  #drawFunctions;

  constructor() {
    const draw = (/** @type {(result: Result, point: Point) => Promise<void>} */ work) =>
      newestOnly(async (/** @type {Result} */ result) => {
        try {
          await work(result, this.#point);
        } catch (error) {
          // A photograph that is no longer shown may have been freed meanwhile.
          if (result === this.#result) throw error;
        }
      });
    this.#drawPictures = draw((result, point) => this.#showPictures(result, point));
    this.#drawFunctions = draw((result, point) => this.#showFunctions(result, point));
    for (const slider of Object.values(this.#sliders)) {
      slider.addEventListener('input', () => {
        const { x, y, size } = this.#sliders;
        this.#move({ x: Number(x.value), y: Number(y.value), size: Number(size.value) });
      });
    }
    const pictures = /** @type {HTMLElement} */ (document.getElementById('pictures'));
    pictures.addEventListener('pointerdown', (event) => this.#followPointer(event));
    pictures.addEventListener('pointermove', (event) => {
      if (event.buttons !== 0) this.#followPointer(event);
    });
    onLanguageChange(() => this.#redraw());
  }

  /** Shows a photograph, or nothing. @param {Result | undefined} result */
  async show(result) {
    this.#result = result;
    this.#section.hidden = result === undefined;
    this.#section.toggleAttribute('data-truth', result?.truth !== undefined);
    if (!result) return;
    const { lightWidth, lightHeight } = result.recovered;
    const flood = new Float32Array(3 * lightWidth * lightHeight).fill(1);
    const picture = await result.recovered.relight(flood);
    if (result !== this.#result) return;
    this.#white = largest(picture);
    this.#move(this.#point);
  }

  #redraw() {
    const result = this.#result;
    if (!result) return;
    this.#drawPictures(result);
    this.#drawFunctions(result);
  }

  /** @param {Point} point */
  #move(point) {
    this.#point = point;
    for (const name of /** @type {const} */ (['x', 'y', 'size'])) {
      const slider = this.#sliders[name];
      slider.value = String(point[name]);
      slider.setAttribute('aria-valuetext', `${formatNumber(100 * point[name])} %`);
    }
    this.#redraw();
  }

  /** @param {PointerEvent} event */
  #followPointer({ target, clientX, clientY }) {
    if (!(target instanceof HTMLCanvasElement)) return;
    const box = target.getBoundingClientRect();
    const share = (/** @type {number} */ at, /** @type {number} */ length) =>
      Math.max(0, Math.min(1, at / length));
    this.#move({
      ...this.#point,
      x: share(clientX - box.left, box.width),
      y: share(clientY - box.top, box.height),
    });
  }

  /** @param {Result} result @param {Point} point */
  async #showPictures(result, point) {
    const { recovered, truth } = result;
    const light = spotLight(recovered, point);
    const [estimate, known] = await Promise.all([
      recovered.relight(light),
      truth?.worker.call('picture', light),
    ]);
    if (result !== this.#result) return;
    const place = { x: 100 * point.x, y: 100 * point.y };
    drawPicture(canvas('recovered-picture'), recovered, estimate, this.#white);
    canvas('recovered-picture').ariaLabel = t('picture.recovered', place);
    this.#pictureSnr = Number.NaN;
    if (known) {
      drawPicture(canvas('true-picture'), recovered, known, this.#white);
      canvas('true-picture').ariaLabel = t('picture.true', place);
      const error = difference(known, estimate);
      drawHeat(canvas('error-picture'), recovered, error, this.#white / DIFFERENCE_GAIN);
      this.#pictureSnr = snr(known, estimate);
      canvas('error-picture').ariaLabel = t('picture.error', {
        snr: formatNumber(this.#pictureSnr, 1),
      });
    }
  }

  /** @param {Result} result @param {Point} point */
  async #showFunctions(result, point) {
    const { recovered, truth } = result;
    const pixel = cameraPixel(recovered, point);
    const element = lightElement(recovered, point);
    const [estimate, scattered, known, knownScattered] = await Promise.all([
      recovered.transportFunction(pixel.x, pixel.y),
      recovered.pointScatteringFunction(element.u, element.v),
      truth?.worker.call('functions', { ...pixel, width: 1, height: 1 }),
      truth?.worker.call('picture', singleElement(recovered, element)),
    ]);
    if (result !== this.#result) return;
    const frame = Math.max(recovered.window, truth?.window ?? 0);
    const white = largest(known ?? estimate.values);
    drawFunction(canvas('recovered-function'), estimate.values, recovered.window, frame, white);
    canvas('recovered-function').ariaLabel = t('function.recovered', pixel);
    drawWindow(recovered, estimate.origin);
    const scatteredWhite = largest(knownScattered ?? scattered);
    drawPicture(canvas('recovered-scattering'), recovered, scattered, scatteredWhite);
    canvas('recovered-scattering').ariaLabel = t('scattering.recovered', element);
    if (known) {
      drawFunction(canvas('true-function'), known, truth?.window ?? frame, frame, white);
      canvas('true-function').ariaLabel = t('function.true', pixel);
      drawPicture(canvas('true-scattering'), recovered, knownScattered, scatteredWhite);
      canvas('true-scattering').ariaLabel = t('scattering.true', element);
    }
    clearTimeout(this.#restTimer);
    this.#restTimer = setTimeout(() => {
      const text = t('point.text', {
        ...pixel,
        ...element,
        elements: elementsWithLight(estimate.values),
        all: recovered.window ** 2,
      });
      const comparison = Number.isFinite(this.#pictureSnr)
        ? t('point.snr', { snr: formatNumber(this.#pictureSnr, 1) })
        : '';
      this.#text.textContent = `${text} ${comparison}`.trim();
    }, REST_MS);
  }
}

/** Draws a function in the middle of a square of `frame` elements. @param {HTMLCanvasElement} canvas @param {Float32Array} values @param {number} side @param {number} frame @param {number} white */
function drawFunction(canvas, values, side, frame, white) {
  const margin = (frame - side) / 2;
  const framed = new Float32Array(3 * frame * frame);
  for (let row = 0; row < side; row += 1) {
    const line = values.subarray(3 * row * side, 3 * (row + 1) * side);
    framed.set(line, 3 * ((row + margin) * frame + margin));
  }
  drawPicture(canvas, { width: frame, height: frame }, framed, white);
}

/** Draws a window on the light plane. @param {Result['recovered']} recovered @param {readonly [number, number]} origin */
function drawWindow({ lightWidth: width, lightHeight: height, window }, [u, v]) {
  const map = svgElement('svg', { viewBox: `0 0 ${width} ${height}`, role: 'img' });
  map.setAttribute('aria-label', t('window.map', { width, height, window, u, v }));
  map.append(
    svgElement('rect', { class: 'plane', width, height }),
    svgElement('rect', { class: 'window', x: u, y: v, width: window, height: window }),
  );
  document.getElementById('window-map')?.replaceChildren(map);
}

/** The number of elements that hold most of a function's light. @param {Float32Array} values */
function elementsWithLight(values) {
  const light = Array.from({ length: values.length / 3 }, (_, s) =>
    Math.max(0, (values[3 * s] ?? 0) + (values[3 * s + 1] ?? 0) + (values[3 * s + 2] ?? 0)),
  ).sort((a, b) => b - a);
  const wanted = TEXT_SHARE * light.reduce((sum, value) => sum + value, 0);
  let [count, held] = [0, 0];
  while (held < wanted && count < light.length) {
    held += light[count] ?? 0;
    count += 1;
  }
  return count;
}
