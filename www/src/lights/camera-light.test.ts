import assert from 'node:assert/strict';
import test from 'node:test';
import type { ImportedPhoto, Light, RelightModule } from '../engine/wasm-exports.js';
import type { ColorMatrix } from '../shared/value-types.js';
import { cameraLightConverter, lightColorMatrix } from './camera-light.js';

const MATRIX: ColorMatrix = [
  [4, -0.6, -0.2],
  [-0.4, 1.5, -0.5],
  [0, -0.4, 1.6],
];

function times(matrix: ColorMatrix, [r = 0, g = 0, b = 0]: readonly number[]): number[] {
  return matrix.map((row) => row[0] * r + row[1] * g + row[2] * b);
}

test('a neutral object has the colour of its light', () => {
  const light = lightColorMatrix(MATRIX);
  assert.ok(light);
  for (const row of light) assert.ok(Math.abs(row[0] + row[1] + row[2] - 1) < 1e-12);
  // A light that excites only red must leave green and blue dark: columns of the matrix times white, M diag(w) L = 1.
  const red = times(light, [1, 0, 0]);
  const white = whiteOf(MATRIX);
  const shown = times(
    MATRIX,
    red.map((channel, c) => channel * (white[c] ?? 0)),
  );
  for (const [c, value] of shown.entries()) assert.ok(Math.abs(value - (c === 0 ? 1 : 0)) < 1e-9);
});

/** The solution of `M w = (1, 1, 1)`, by iteration: the matrix is nearly diagonal. */
function whiteOf(matrix: ColorMatrix): number[] {
  let white = [0, 0, 0];
  for (let i = 0; i < 200; i += 1) {
    const error = times(matrix, white).map((value) => 1 - value);
    white = white.map((w, c) => w + (error[c] ?? 0) / (matrix[c]?.[c] ?? 1));
  }
  return white;
}

test('a matrix without inverse converts nothing', () => {
  assert.equal(
    lightColorMatrix([
      [1, 1, 1],
      [1, 1, 1],
      [1, 1, 1],
    ]),
    null,
  );
});

test('lights are converted and freed only where there is a colour matrix', () => {
  const freed: string[] = [];
  const light = (name: string, values: Float32Array) =>
    ({ linearRgb: () => values, free: () => freed.push(name) }) as unknown as Light;
  const made: Float32Array[] = [];
  const module = {
    Light: {
      fromLinear: (_: ImportedPhoto, values: Float32Array) => {
        made.push(values);
        return light('new', values);
      },
    },
  } as unknown as Pick<RelightModule, 'Light'>;
  const plane = {} as ImportedPhoto;
  const info = { lightWidth: 1, lightHeight: 1 };
  const photograph = (hasColorMatrix: boolean) => ({
    colorMatrix: MATRIX,
    hasColorMatrix,
    descriptor: info,
  });
  const old = light('old', Float32Array.of(1, 1, 1));
  assert.equal(cameraLightConverter(module, plane, photograph(false))(old), old);
  assert.deepEqual(freed, []);
  cameraLightConverter(module, plane, photograph(true))(old);
  assert.deepEqual(freed, ['old']);
  for (const value of made[0] ?? []) assert.ok(Math.abs(value - 1) < 1e-6);
});
