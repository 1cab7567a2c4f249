/** A capture folder from photographs that the page took. */

import { greyPng, rgb16Png } from './png.js';

/** Code of a photograph at full scale; saturated samples have it. */
const WHITE = 65535;

/** @typedef {import('./light-patterns.js').LightPattern} LightPattern */
/** @typedef {{ pattern: LightPattern, photograph: Float32Array }} PatternPhotograph linear RGB of each pixel, NaN where saturated */

/**
 * The files by their paths.
 *
 * @param {PatternPhotograph[]} photographs with dark, flood and all Gray code
 * @param {{ side: number, lightSide: number, title: string }} capture
 * @returns {Promise<ReadonlyMap<string, Blob>>}
 */
export async function captureFiles(photographs, { side, lightSide, title }) {
  /** @type {Map<string, Blob>} */
  const files = new Map();
  const manifest = {
    version: 1,
    title,
    // Patterns have the codes 0 and 255, so that no gamma is assumed.
    light: { width: lightSide, height: lightSide, gamma: 2.2 },
    camera: { width: side, height: side, black: 0, white: WHITE },
    dark: 'photos/dark.png',
    flood: 'photos/flood.png',
    shots: /** @type {object[]} */ ([]),
    graycode: /** @type {object[]} */ ([]),
  };
  for (const { pattern, photograph } of photographs) {
    const { kind, name, axis, bit, inverted, codes } = pattern;
    const photo = `photos/${name}.png`;
    files.set(photo, await rgb16Png(side, side, Uint16Array.from(photograph, toCode)));
    if (kind === 'grayCode') manifest.graycode.push({ photo, axis, bit, inverted });
    if (kind !== 'random') continue;
    const path = `patterns/${name}.png`;
    files.set(path, await greyPng(lightSide, lightSide, codes));
    manifest.shots.push({ pattern: path, photo });
  }
  // Readers expect the most significant bit first.
  manifest.graycode.sort((a, b) => order(b) - order(a));
  const json = new Blob([`${JSON.stringify(manifest, null, 1)}\n`], { type: 'application/json' });
  return new Map([['capture.json', json], ...files]);
}

/** @param {number} value */
function toCode(value) {
  return Number.isNaN(value) ? WHITE : Math.max(0, Math.min(WHITE - 1, Math.round(WHITE * value)));
}

/** @param {Partial<LightPattern>} photo */
function order({ axis, bit = 0, inverted }) {
  return (axis === 'x' ? 1000 : 0) + 2 * bit + (inverted ? 0 : 1);
}
