/**
 * Lights as the channels of a camera see them, for photographs with a colour matrix M: `diag(1/w) M⁻¹` times the light's
 * RGB, where `w = M⁻¹ (1, 1, 1)`. White stays white, and neutral objects have the colour of their light.
 */

import type { ImportedPhoto, Light, RelightModule } from '../engine/wasm-exports.js';
import type { ColorMatrix, PhotoInfo, RgbGains } from '../shared/value-types.js';

export type LightConverter = (light: Light) => Light;

/** What lights need to know of a photograph. */
export interface CameraColors {
  readonly colorMatrix: ColorMatrix;
  readonly hasColorMatrix: boolean;
  readonly descriptor: Pick<PhotoInfo, 'lightWidth' | 'lightHeight'>;
}

/** Frees the light that it converts. `lightPlane` is a photograph without tiles. */
export function cameraLightConverter(
  { Light }: Pick<RelightModule, 'Light'>,
  lightPlane: ImportedPhoto,
  { colorMatrix, hasColorMatrix, descriptor }: CameraColors,
): LightConverter {
  const matrix = hasColorMatrix ? lightColorMatrix(colorMatrix) : null;
  if (!matrix) return (light) => light;
  const { lightWidth, lightHeight } = descriptor;
  const [toRed, toGreen, toBlue] = matrix;
  return (light) => {
    const values = light.linearRgb(0, lightHeight);
    light.free();
    for (let i = 0; i < values.length; i += 3) {
      const red = values[i] ?? 0;
      const green = values[i + 1] ?? 0;
      const blue = values[i + 2] ?? 0;
      values[i] = Math.max(0, toRed[0] * red + toRed[1] * green + toRed[2] * blue);
      values[i + 1] = Math.max(0, toGreen[0] * red + toGreen[1] * green + toGreen[2] * blue);
      values[i + 2] = Math.max(0, toBlue[0] * red + toBlue[1] * green + toBlue[2] * blue);
    }
    return Light.fromLinear(lightPlane, values, lightWidth, lightHeight, true);
  };
}

/** `null` if the colour matrix has no inverse, or white is no mixture of its colours. */
export function lightColorMatrix(matrix: ColorMatrix): ColorMatrix | null {
  const [a, b, c] = matrix;
  // The columns of the inverse, times the determinant, which cancels out but for its sign.
  const [x, y, z] = [cross(b, c), cross(c, a), cross(a, b)];
  const sign = Math.sign(a[0] * x[0] + a[1] * x[1] + a[2] * x[2]);
  const row = (i: 0 | 1 | 2): RgbGains => {
    const sum = x[i] + y[i] + z[i];
    return [x[i] / sum, y[i] / sum, z[i] / sum];
  };
  const isMixture = ([0, 1, 2] as const).every((i) => sign * (x[i] + y[i] + z[i]) > 0);
  return isMixture ? [row(0), row(1), row(2)] : null;
}

function cross(a: RgbGains, b: RgbGains): RgbGains {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}
