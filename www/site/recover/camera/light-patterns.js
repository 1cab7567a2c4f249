/** The patterns of a capture with a camera, in the order in which they are shown. */

/**
 * @typedef {object} LightPattern
 * @property {'dark' | 'flood' | 'grayCode' | 'random'} kind
 * @property {string} name of its files, without ending
 * @property {'x' | 'y'} [axis] of Gray code
 * @property {number} [bit] of Gray code; 0 is the least significant
 * @property {boolean} [inverted] of Gray code
 * @property {Uint8Array} codes of the light elements, 0 or 255
 */

/**
 * Dark, flood, Gray code and random patterns whose elements are on or off: their emission does not depend on the screen's
 * gamma. A camera must see where one ends and the next begins, so no pattern follows one that would look the same
 * through a blurring object.
 *
 * @param {number} side of the light plane, in elements
 * @param {number} count of random patterns
 * @param {number} seed
 * @returns {LightPattern[]}
 */
export function lightPatterns(side, count, seed) {
  const uniform = (/** @type {number} */ code) => new Uint8Array(side * side).fill(code);
  const random = randomBits(seed);
  return [
    { kind: 'dark', name: 'dark', codes: uniform(0) },
    { kind: 'flood', name: 'flood', codes: uniform(255) },
    ...grayCode(side, 'x'),
    ...grayCode(side, 'y'),
    ...Array.from({ length: count }, (_, i) => ({
      kind: /** @type {const} */ ('random'),
      name: String(i).padStart(4, '0'),
      codes: Uint8Array.from({ length: side * side }, () => 255 * random()),
    })),
  ];
}

/** Each bit and its inverse; fine stripes, which blur to grey, stand between coarse ones. @param {number} side @param {'x' | 'y'} axis @returns {LightPattern[]} */
function grayCode(side, axis) {
  const bits = Math.max(1, Math.ceil(Math.log2(side)));
  const all = Array.from({ length: bits }, (_, i) => bits - 1 - i).flatMap((bit) =>
    [false, true].map((inverted) => grayCodePattern(side, axis, bit, inverted)),
  );
  const coarse = all.splice(0, Math.ceil(all.length / 2));
  return coarse.flatMap((pattern, i) => [pattern, ...all.slice(i, i + 1)]);
}

/** @param {number} side @param {'x' | 'y'} axis @param {number} bit @param {boolean} inverted @returns {LightPattern} */
function grayCodePattern(side, axis, bit, inverted) {
  const codes = Uint8Array.from({ length: side * side }, (_, m) => {
    const n = axis === 'x' ? m % side : Math.floor(m / side);
    const isOn = (((n ^ (n >> 1)) >> bit) & 1) === 1;
    return isOn === inverted ? 0 : 255;
  });
  const name = `${axis}${bit}${inverted ? 'n' : 'p'}`;
  return { kind: 'grayCode', name, axis, bit, inverted, codes };
}

/** Random zeros and ones: the generator mulberry32. @param {number} seed */
function randomBits(seed) {
  let state = seed;
  return () => {
    state = (state + 0x6d2b79f5) | 0;
    let mixed = Math.imul(state ^ (state >>> 15), 1 | state);
    mixed = (mixed + Math.imul(mixed ^ (mixed >>> 7), 61 | mixed)) ^ mixed;
    return ((mixed ^ (mixed >>> 14)) >>> 31) & 1;
  };
}
