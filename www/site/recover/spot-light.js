/** The light that a visitor moves: a round spot on the light plane. */

/** @typedef {{ width: number, height: number, lightWidth: number, lightHeight: number, correspondence: readonly (readonly number[])[] }} TransportSize */
/** @typedef {{ x: number, y: number, size: number }} Point shares of the picture's width and height; the size is a share of the light plane's shorter side */

/** The point of the light plane behind a point of the picture, in light elements. @param {TransportSize} size @param {Point} point */
export function lightPosition({ width, height, correspondence }, { x, y }) {
  const [u, v] = correspondence.map(([a = 0, b = 0, c = 0]) => a * x * width + b * y * height + c);
  return { u: u ?? 0, v: v ?? 0 };
}

/** The camera pixel at a point of the picture. @param {TransportSize} size @param {Point} point */
export function cameraPixel({ width, height }, { x, y }) {
  return { x: cell(x * width, width), y: cell(y * height, height) };
}

/** The light element nearest to the point behind a point of the picture. @param {TransportSize} size @param {Point} point */
export function lightElement(size, point) {
  const { u, v } = lightPosition(size, point);
  return { u: cell(u, size.lightWidth), v: cell(v, size.lightHeight) };
}

/** Linear RGB of a white Gaussian spot, `[M, 3]`. @param {TransportSize} size @param {Point} point */
export function spotLight(size, point) {
  const { lightWidth, lightHeight } = size;
  const { u, v } = lightPosition(size, point);
  const radius = point.size * Math.min(lightWidth, lightHeight);
  const light = new Float32Array(3 * lightWidth * lightHeight);
  for (let row = 0, m = 0; row < lightHeight; row += 1) {
    for (let column = 0; column < lightWidth; column += 1, m += 3) {
      const distance = Math.hypot(column + 0.5 - u, row + 0.5 - v) / radius;
      light.fill(Math.exp(-0.5 * distance * distance), m, m + 3);
    }
  }
  return light;
}

/** A light with one element on. @param {TransportSize} size @param {{ u: number, v: number }} element */
export function singleElement({ lightWidth, lightHeight }, { u, v }) {
  const light = new Float32Array(3 * lightWidth * lightHeight);
  const first = 3 * (v * lightWidth + u);
  return light.fill(1, first, first + 3);
}

/** @param {number} position @param {number} count */
function cell(position, count) {
  return Math.max(0, Math.min(count - 1, Math.floor(position)));
}
