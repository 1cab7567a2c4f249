/** The light that a page's script sets: the element's property `light`, which replaces the light of the attributes. */

import { parseLightColor } from '../lights/light-color.js';
import { checkLightSource, type LightSource } from '../lights/light-source.js';
import type { LightName } from '../shared/keywords.js';
import { CENTRE, clampToPicture } from '../shared/value-types.js';
import { PARSERS } from './attribute-parsers.js';
import type { LightAttributes } from './options.js';

/** A built-in light. Absent fields follow the attributes. */
export interface LightOptions {
  readonly name?: LightName;
  /** The torch's position, 0 to 1 across the picture. */
  readonly x?: number;
  /** The torch's position, 0 to 1 down the picture. */
  readonly y?: number;
  /** The torch's radius, as a fraction of the light plane's shorter side. */
  readonly size?: number;
  /** Any CSS colour. */
  readonly color?: string;
}

/** The name of a built-in light, its options, or a source that replaces it; `null` is the light of the attributes. */
export type LightValue = LightName | LightOptions | LightSource | null;

/** Values that take precedence over the options; `null` leaves an option in effect. */
export type LightOverrides = {
  readonly [K in 'name' | 'torch' | 'size' | 'color']: LightAttributes[K] | null;
};

/** The script's light as overrides and a source. */
export interface PageLight extends LightOverrides {
  readonly source: LightSource | null;
}

export const NO_OVERRIDES: LightOverrides = { name: null, torch: null, size: null, color: null };
export const NO_PAGE_LIGHT: PageLight = { ...NO_OVERRIDES, source: null };

const FIELDS = ['name', 'x', 'y', 'size', 'color'];

/** @throws {TypeError | PhotoError} for an invalid value */
export function parsePageLight(value: LightValue, attributes: LightAttributes): PageLight {
  const none = NO_PAGE_LIGHT;
  if (value === null) return none;
  if (typeof value === 'string') return { ...none, name: PARSERS.light(value) };
  if (!isOptions(value)) return { ...none, source: checkLightSource(value) };
  checkFields(value, 'light', ['x', 'y', 'size']);
  const { name, x, y, size, color } = value;
  const hasPoint = x !== undefined || y !== undefined;
  const torch = attributes.torch ?? CENTRE;
  return {
    ...none,
    name: name === undefined ? null : PARSERS.light(name),
    torch: hasPoint ? clampToPicture({ x: x ?? torch.x, y: y ?? torch.y }) : null,
    size: size === undefined ? null : PARSERS['light-size'](String(size)),
    color: color === undefined ? null : parseLightColor(color),
  };
}

/** @throws {TypeError} if `value` is no object, or one of the fields that it has is no finite number */
export function checkFields(value: unknown, property: string, fields: readonly string[]): void {
  if (typeof value !== 'object' || value === null) {
    throw new TypeError(`${property} must be an object with ${fields.join(', ')}`);
  }
  for (const name of fields) {
    const number = (value as Record<string, unknown>)[name];
    if (number === undefined || Number.isFinite(number)) continue;
    throw new TypeError(`${property}.${name} must be a finite number, but is ${String(number)}`);
  }
}

/** A plain object with fields of `LightOptions` only. */
function isOptions(value: LightOptions | LightSource): value is LightOptions {
  if (Object.getPrototypeOf(value) !== Object.prototype) return false;
  return Object.keys(value).every((key) => FIELDS.includes(key));
}
