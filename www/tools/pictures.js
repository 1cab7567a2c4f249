/** Reads, writes and compares pictures. */

import { PNG } from 'pngjs';

/** @typedef {{ width: number, height: number, data: Uint8Array }} Picture RGBA, row by row */

/**
 * @param {Buffer} bytes of a PNG file
 * @returns {Picture}
 */
export function decodePng(bytes) {
  const { width, height, data } = PNG.sync.read(bytes);
  return { width, height, data };
}

/** @param {Picture} picture */
export function encodePng({ width, height, data }) {
  const png = new PNG({ width, height });
  png.data = Buffer.from(data);
  return PNG.sync.write(png);
}

/**
 * @param {Picture} a
 * @param {Picture} b
 * @returns {{ worst: number, psnr: number }} largest difference of a code, out of 255, and the peak
 *   signal-to-noise ratio over R, G and B in dB, `Infinity` for equal pictures
 */
export function compare(a, b) {
  checkSameSize(a, b);
  let worst = 0;
  let squares = 0;
  for (let i = 0; i < a.data.length; i += 1) {
    const difference = Math.abs((a.data[i] ?? 0) - (b.data[i] ?? 0));
    worst = Math.max(worst, difference);
    if (i % 4 !== 3) squares += difference * difference;
  }
  const meanSquare = squares / ((a.data.length / 4) * 3);
  return { worst, psnr: 10 * Math.log10((255 * 255) / meanSquare) };
}

/**
 * Centre of brightness, from 0 to 1 in x and y, and mean code.
 *
 * @param {Picture} picture
 */
export function brightest({ width, height, data }) {
  let [sum, x, y] = [0, 0, 0];
  for (let i = 0; i < width * height; i += 1) {
    const value = (data[4 * i] ?? 0) + (data[4 * i + 1] ?? 0) + (data[4 * i + 2] ?? 0);
    sum += value;
    x += value * ((i % width) + 0.5);
    y += value * (Math.floor(i / width) + 0.5);
  }
  return { x: x / sum / width, y: y / sum / height, mean: sum / (3 * width * height) };
}

/** @param {Picture} a @param {Picture} b */
function checkSameSize(a, b) {
  if (a.width === b.width && a.height === b.height) return;
  const sizes = [a, b].map(({ width, height }) => `${width}x${height}`).join(' and ');
  throw new Error(`the pictures differ in size: ${sizes}`);
}
