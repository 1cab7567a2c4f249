/**
 * Light and view as a query string, for links: `l=torch&x=0.312&y=0.64&r=0.2&z=2&vx=0.5&vy=0.41&e=1.2`. A prefix before
 * each key keeps the states of several photographs apart.
 *
 * | key | value |
 * |---|---|
 * | `l` | name of the light |
 * | `x`, `y`, `r` | position and radius of the torch |
 * | `c` | colour of the light, hexadecimal without `#` |
 * | `e` | exposure |
 * | `z`, `vx`, `vy` | zoom and centre of the view |
 */

import { PhotoError } from '../shared/errors.js';
import { LIGHTS, type LightName } from '../shared/keywords.js';
import { MAX_EXPOSURE } from '../shared/setting-parsers.js';
import { CENTRE, type PicturePoint } from '../shared/value-types.js';
import { MAX_TORCH_SIZE } from './attribute-parsers.js';
import type { ZoomView } from './viewport.js';

/** What a visitor may have changed; `null` stands for the page's own value. */
export interface ShareLinkState {
  readonly light: LightName | null;
  readonly torch: PicturePoint | null;
  /** The torch's radius in units of the light plane's shorter side. */
  readonly size: number | null;
  /** A CSS colour. */
  readonly color: string | null;
  readonly exposure: number | null;
  readonly view: ZoomView;
}

/** Beyond any `zoom` attribute; the view is clamped to that. */
const MAX_SHARED_ZOOM = 1e4;

export function formatState(state: ShareLinkState, prefix = ''): string {
  const { light, torch, size, color, exposure, view } = state;
  const params = new URLSearchParams();
  const put = (key: string, value: string | number | null | undefined) => {
    if (value != null) params.set(prefix + key, String(value));
  };
  put('l', light);
  put('x', torch?.x);
  put('y', torch?.y);
  put('r', size);
  // An unescaped # would begin the fragment of an address.
  put('c', color?.replace(/^#/, ''));
  if (view.zoom > 1) {
    put('z', view.zoom);
    put('vx', view.x);
    put('vy', view.y);
  }
  put('e', exposure);
  return params.toString();
}

/** Parses a state. An invalid value counts as absent and gives an error; unknown keys are ignored. */
export function parseState(
  text: string,
  prefix = '',
): { state: ShareLinkState; errors: readonly PhotoError[] } {
  const params = new URLSearchParams(text.replace(/^[?#]/, ''));
  const errors: PhotoError[] = [];
  /** Reads a value; `parse` gives `null` if it is invalid. */
  const read = <T>(key: string, expected: string, parse: (value: string) => T | null): T | null => {
    const value = params.get(prefix + key);
    const parsed = value === null ? null : parse(value);
    if (value !== null && parsed === null) {
      const message = `The state “${text}” has ${prefix}${key}=${value}. Expected ${expected}.`;
      errors.push(new PhotoError('state', message));
    }
    return parsed;
  };
  const number = (key: string, min: number, max: number) =>
    read(key, `a number from ${min} to ${max}`, (value) => {
      const parsed = value.trim() === '' ? Number.NaN : Number(value);
      return parsed >= min && parsed <= max ? parsed : null;
    });
  const findLight = (value: string) => LIGHTS.find((known) => known === value) ?? null;
  const light = read('l', `one of ${LIGHTS.join(', ')}`, findLight);
  const color = read('c', 'a colour in hexadecimal digits', (value) =>
    /^([0-9a-f]{3,4}|[0-9a-f]{6}|[0-9a-f]{8})$/i.test(value) ? `#${value}` : null,
  );
  const [x, y] = [number('x', 0, 1), number('y', 0, 1)];
  const zoom = number('z', 1, MAX_SHARED_ZOOM) ?? 1;
  const [viewX, viewY] = [number('vx', 0, 1), number('vy', 0, 1)];
  return {
    state: {
      light,
      torch: x === null && y === null ? null : { x: x ?? CENTRE.x, y: y ?? CENTRE.y },
      size: number('r', 1e-6, MAX_TORCH_SIZE),
      color,
      exposure: number('e', 0, MAX_EXPOSURE),
      view: { zoom, x: viewX ?? CENTRE.x, y: viewY ?? CENTRE.y },
    },
    errors,
  };
}
