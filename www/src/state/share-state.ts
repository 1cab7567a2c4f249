/** Light and view as text, for addresses: `l=torch&x=0.312&y=0.64&z=2&vx=0.5&vy=0.41&e=1.2`. */

import { PhotoError } from '../shared/errors.js';
import { LIGHTS, type LightName } from '../shared/names.js';
import { MAX_EXPOSURE } from '../shared/parse-settings.js';
import type { PicturePoint } from '../shared/values.js';
import { MAX_TORCH_SIZE } from './attribute-values.js';
import { type PhotoView, WHOLE } from './viewport.js';

/** What a visitor may have changed; `null` is as the page has it. */
export interface PhotoState {
  readonly light: LightName | null;
  readonly torch: PicturePoint | null;
  /** Radius of the torch, of the light plane's shorter side. */
  readonly size: number | null;
  /** Any CSS colour. */
  readonly color: string | null;
  readonly exposure: number | null;
  readonly view: PhotoView;
}

/** That state in a few letters, all of which addresses may hold. */
export function writeState({ light, torch, size, color, exposure, view }: PhotoState): string {
  const words = new URLSearchParams();
  const put = (key: string, value: string | number | null | undefined) => {
    if (value != null) words.set(key, String(value));
  };
  put('l', light);
  put('x', torch?.x);
  put('y', torch?.y);
  put('s', size);
  // An address has another use for #.
  put('c', color?.replace(/^#/, ''));
  if (view.zoom > 1) {
    put('z', view.zoom);
    put('vx', view.x);
    put('vy', view.y);
  }
  put('e', exposure);
  return words.toString();
}

/** What such a text says, and what is wrong with it: that counts as left out. Other keys are passed over. */
export function readState(text: string): { state: PhotoState; faults: readonly PhotoError[] } {
  const words = new URLSearchParams(text.replace(/^[?#]/, ''));
  const faults: PhotoError[] = [];
  const wrong = (key: string, value: string, right: string): null => {
    const message = `The state “${text}” has ${key}=${value}, where ${key} is ${right}.`;
    faults.push(new PhotoError('state', message));
    return null;
  };
  const number = (key: string, least: number, most: number): number | null => {
    const value = words.get(key);
    if (value === null) return null;
    const read = value.trim() === '' ? Number.NaN : Number(value);
    if (read >= least && read <= most) return read;
    return wrong(key, value, `a number from ${least} to ${most}`);
  };
  const name = words.get('l');
  const light = LIGHTS.find((known) => known === name) ?? null;
  if (name !== null && !light) wrong('l', name, `one of ${LIGHTS.join(', ')}`);
  const hex = words.get('c');
  const isColor = hex !== null && /^([0-9a-f]{3,4}|[0-9a-f]{6}|[0-9a-f]{8})$/i.test(hex);
  if (hex !== null && !isColor) wrong('c', hex, 'a colour in hexadecimal digits');
  const [x, y] = [number('x', 0, 1), number('y', 0, 1)];
  const zoom = number('z', 1, 1e4) ?? 1;
  const [vx, vy] = [number('vx', 0, 1), number('vy', 0, 1)];
  const torch = x === null && y === null ? null : { x: x ?? 0.5, y: y ?? 0.5 };
  return {
    state: {
      light,
      torch,
      size: number('s', 1e-6, MAX_TORCH_SIZE),
      color: isColor ? `#${hex}` : null,
      exposure: number('e', 0, MAX_EXPOSURE),
      view: { zoom, x: vx ?? WHOLE.x, y: vy ?? WHOLE.y },
    },
    faults,
  };
}
