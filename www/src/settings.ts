/** Attribute values, checked. Each parser throws a `PhotoError` that names what it would take. */

import type { Backend } from './engine.js';
import { PhotoError } from './errors.js';

/** The built-in lights, in the order menus show them. */
export const LIGHTS = ['flood', 'torch', 'checkerboard', 'stripes', 'spectrum', 'fire'] as const;

/** The name of a built-in light. */
export type LightName = (typeof LIGHTS)[number];

/** The back ends, the fastest first: the order in which they are tried. */
export const BACKENDS: readonly Backend[] = ['webgpu', 'webgl2', 'cpu'];

/** A position on the picture: 0, 0 is the top left corner and 1, 1 the bottom right. */
export interface PicturePoint {
  readonly x: number;
  readonly y: number;
}

const DEFAULT_LIGHT: LightName = 'flood';
const DEFAULT_EXPOSURE = 1;
/** What the module, which computes in 32-bit floats, can take. */
const MAX_EXPOSURE = 2 ** 127 * (2 - 2 ** -23);

/** The `light` attribute; flood where there is none. */
export function parseLight(value: string | null): LightName {
  const name = value?.trim() || DEFAULT_LIGHT;
  const known = LIGHTS.find((light) => light === name);
  if (known) return known;
  throw new PhotoError(
    'attribute',
    `There is no light named “${name}”. Known lights: ${LIGHTS.join(', ')}.`,
  );
}

/** The `backend` attribute, a list in order of preference; all of them where there is none. */
export function parseBackends(value: string | null): readonly Backend[] {
  const names = value?.split(/[\s,]+/).filter(Boolean) ?? [];
  if (names.length === 0) return BACKENDS;
  const order = new Set<Backend>();
  for (const name of names) {
    const known = BACKENDS.find((backend) => backend === name);
    if (!known) {
      throw new PhotoError(
        'attribute',
        `There is no back end named “${name}”. Known back ends: ${BACKENDS.join(', ')}.`,
      );
    }
    order.add(known);
  }
  return [...order];
}

/** The `exposure` attribute, a factor on the light's brightness; 1 where there is none. */
export function parseExposure(value: string | null): number {
  if (value === null || value.trim() === '') return DEFAULT_EXPOSURE;
  const exposure = Number(value);
  if (exposure >= 0 && exposure <= MAX_EXPOSURE) return exposure;
  throw new PhotoError(
    'attribute',
    `The exposure “${value}” is not a number from 0 to ${MAX_EXPOSURE.toPrecision(2)}; ` +
      '1 shows the photograph as taken.',
  );
}

/** Where an arrow key takes a torch, or `undefined` for any other key. Shift makes small steps. */
export function stepTorch(
  from: PicturePoint,
  key: string,
  fine: boolean,
): PicturePoint | undefined {
  const step = fine ? 0.01 : 0.05;
  switch (key) {
    case 'ArrowLeft':
      return clampToPicture({ x: from.x - step, y: from.y });
    case 'ArrowRight':
      return clampToPicture({ x: from.x + step, y: from.y });
    case 'ArrowUp':
      return clampToPicture({ x: from.x, y: from.y - step });
    case 'ArrowDown':
      return clampToPicture({ x: from.x, y: from.y + step });
    default:
      return undefined;
  }
}

/** The nearest point that lies on the picture. */
export function clampToPicture({ x, y }: PicturePoint): PicturePoint {
  return { x: Math.min(1, Math.max(0, x)), y: Math.min(1, Math.max(0, y)) };
}
