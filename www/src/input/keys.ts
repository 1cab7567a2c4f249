/** Maps key presses to actions. Independent of the DOM. */

export type KeyPress = Pick<
  KeyboardEvent,
  'key' | 'code' | 'shiftKey' | 'ctrlKey' | 'metaKey' | 'altKey'
>;

/** Distances are fractions of the picture for the light, and of the viewport for panning. */
export type KeyAction =
  | { readonly kind: 'move-light' | 'pan'; readonly dx: number; readonly dy: number }
  | { readonly kind: 'zoom' | 'select-light'; readonly by: 1 | -1 }
  | { readonly kind: 'reset-view' | 'actual-size' | 'escape' };

/** The focused part: the torch handle, the picture (if no light can be moved), or the controls. */
export type FocusedPart = 'light' | 'picture' | 'controls';

const LIGHT_STEP = 0.05;
/** With Shift. */
const FINE_LIGHT_STEP = 0.01;
const PAN_STEP = 0.15;

type ArrowDirection = readonly [x: number, y: number];

const ARROWS: Readonly<Record<string, ArrowDirection>> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
};

/** Physical keys, which form the same cross on every layout. */
const PAN_CODES: Readonly<Record<string, ArrowDirection>> = {
  KeyA: [-1, 0],
  KeyD: [1, 0],
  KeyW: [0, -1],
  KeyS: [0, 1],
};

/** Larger moves of the light; a whole picture reaches the edge. */
const LIGHT_MOVES: Readonly<Record<string, ArrowDirection>> = {
  PageUp: [0, -0.2],
  PageDown: [0, 0.2],
  Home: [-1, 0],
  End: [1, 0],
};

export function keyAction(press: KeyPress, focus: FocusedPart): KeyAction | null {
  const { key, metaKey, ctrlKey, altKey } = press;
  if (metaKey || (ctrlKey && !altKey)) return null;
  // Many layouts type brackets with Alt, some with Ctrl and Alt.
  if (key === '[' || key === ']') return { kind: 'select-light', by: key === ']' ? 1 : -1 };
  if (altKey) return null;
  return zoomAction(key) ?? (focus === 'controls' ? null : pictureAction(press, focus));
}

function zoomAction(key: string): KeyAction | null {
  if (key === '+' || key === '=') return { kind: 'zoom', by: 1 };
  if (key === '-' || key === '_') return { kind: 'zoom', by: -1 };
  if (key === '1') return { kind: 'actual-size' };
  return key === '0' ? { kind: 'reset-view' } : null;
}

function pictureAction({ key, code, shiftKey }: KeyPress, focus: FocusedPart): KeyAction | null {
  if (key === 'Escape') return { kind: 'escape' };
  const hasLight = focus === 'light';
  const arrow = ARROWS[key];
  // The view moves in the key's direction, so the picture moves the other way.
  const pan = PAN_CODES[code] ?? (hasLight ? null : arrow);
  if (pan) return move('pan', pan, -PAN_STEP);
  if (!hasLight) return null;
  if (arrow) return move('move-light', arrow, shiftKey ? FINE_LIGHT_STEP : LIGHT_STEP);
  const vector = LIGHT_MOVES[key];
  return vector ? move('move-light', vector, 1) : null;
}

function move(kind: 'move-light' | 'pan', [x, y]: ArrowDirection, step: number): KeyAction {
  return { kind, dx: step * x, dy: step * y };
}
