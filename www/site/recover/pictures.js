/** Linear pictures on canvases, and their distance. */

/** @typedef {{ width: number, height: number }} Size */

/** sRGB codes of linear values from 0 to 1. */
const CODES = Uint8ClampedArray.from({ length: 4096 }, (_, i) => {
  const linear = i / 4095;
  return 255 * (linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055);
});

/** Of red, green and blue, in `drawHeat`. */
const HEAT_GAINS = [2.2, 1.35, 1];

/** @param {number} linear */
const code = (linear) => CODES[Math.max(0, Math.min(4095, Math.round(4095 * linear)))] ?? 0;

/** Draws linear RGB, `[N, 3]`; `white` is the value that becomes white. @param {HTMLCanvasElement} canvas @param {Size} size @param {Float32Array} values @param {number} white */
export function drawPicture(canvas, size, values, white) {
  draw(canvas, size, (n, data) => {
    for (let c = 0; c < 3; c += 1) data[4 * n + c] = code((values[3 * n + c] ?? 0) / white);
  });
}

/** Draws values from 0, black, over red and orange to `white`. @param {HTMLCanvasElement} canvas @param {Size} size @param {ArrayLike<number>} values @param {number} white */
export function drawHeat(canvas, size, values, white) {
  draw(canvas, size, (n, data) => {
    const heat = Math.max(0, Math.min(1, (values[n] ?? 0) / white));
    for (const [c, gain] of HEAT_GAINS.entries()) data[4 * n + c] = 255 * gain * heat ** (1 + c);
  });
}

/** The absolute difference of two pictures at each pixel, as a mean over channels. @param {Float32Array} a @param {Float32Array} b */
export function difference(a, b) {
  return Float32Array.from({ length: a.length / 3 }, (_, n) => {
    let sum = 0;
    for (let i = 3 * n; i < 3 * n + 3; i += 1) sum += Math.abs((a[i] ?? 0) - (b[i] ?? 0));
    return sum / 3;
  });
}

/** SNR of an estimate in decibels. @param {Float32Array} truth @param {Float32Array} estimate */
export function snr(truth, estimate) {
  let [signal, error] = [0, 0];
  for (let i = 0; i < truth.length; i += 1) {
    const value = truth[i] ?? 0;
    signal += value ** 2;
    error += (value - (estimate[i] ?? 0)) ** 2;
  }
  return 10 * Math.log10(signal / error);
}

/** @param {ArrayLike<number>} values */
export function largest(values) {
  let peak = 0;
  for (let i = 0; i < values.length; i += 1) peak = Math.max(peak, values[i] ?? 0);
  return peak || 1;
}

/** `drawPixel` writes the colour of a pixel. @param {HTMLCanvasElement} canvas @param {Size} size @param {(n: number, data: Uint8ClampedArray) => void} drawPixel */
function draw(canvas, { width, height }, drawPixel) {
  if (canvas.width !== width) canvas.width = width;
  if (canvas.height !== height) canvas.height = height;
  const image = new ImageData(width, height);
  for (let n = 0; n < width * height; n += 1) {
    drawPixel(n, image.data);
    image.data[4 * n + 3] = 255;
  }
  canvas.getContext('2d')?.putImageData(image, 0, 0);
}
