/** What keys do while the element has the focus. */

/** What of a keyboard event counts. */
export interface Key {
  readonly key: string;
  /** Where on the keyboard it is, whatever it writes. */
  readonly code: string;
  readonly shiftKey: boolean;
  readonly ctrlKey: boolean;
  readonly metaKey: boolean;
  readonly altKey: boolean;
}

/** What a key asks for. Distances are fractions: of the picture for the light, of the box for the view. */
export type KeyAction =
  | { readonly kind: 'move'; readonly dx: number; readonly dy: number }
  | { readonly kind: 'jump'; readonly x: 0 | 1 }
  | { readonly kind: 'pan'; readonly dx: number; readonly dy: number }
  | { readonly kind: 'zoom'; readonly by: 1 | -1 }
  | { readonly kind: 'whole' }
  | { readonly kind: 'light'; readonly by: 1 | -1 }
  | { readonly kind: 'leave' };

/** What has the focus: the light, the picture where its light does not move, or one of the controls. */
export type Focus = 'light' | 'picture' | 'controls';

const STEP = 0.05;
const FINE = 0.01;
const LARGE = 0.2;
const PAN = 0.15;

const ARROWS: Readonly<Record<string, readonly [number, number]>> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
};

/** By their place: they lie as arrows do on every keyboard. */
const PAN_CODES: Readonly<Record<string, readonly [number, number]>> = {
  KeyA: [-1, 0],
  KeyD: [1, 0],
  KeyW: [0, -1],
  KeyS: [0, 1],
};

/** What a key does there; `null` where it is none of the element's. */
export function keyAction(key: Key, focus: Focus): KeyAction | null {
  if (key.metaKey || (key.ctrlKey && !key.altKey)) return null;
  // Many keyboards write brackets with Alt, some with Ctrl too.
  if (key.key === '[' || key.key === ']') return { kind: 'light', by: key.key === ']' ? 1 : -1 };
  if (key.altKey) return null;
  return anywhere(key) ?? (focus === 'controls' ? null : onPicture(key, focus));
}

function anywhere({ key }: Key): KeyAction | null {
  switch (key) {
    case '+':
    case '=':
      return { kind: 'zoom', by: 1 };
    case '-':
    case '_':
      return { kind: 'zoom', by: -1 };
    case '0':
      return { kind: 'whole' };
    default:
      return null;
  }
}

function onPicture({ key, code, shiftKey }: Key, focus: Focus): KeyAction | null {
  const arrow = ARROWS[key];
  const pans = PAN_CODES[code] ?? (focus === 'picture' ? arrow : undefined);
  // The view goes where the key points to, so what is seen goes the other way.
  if (pans) return { kind: 'pan', dx: -PAN * pans[0], dy: -PAN * pans[1] };
  if (key === 'Escape') return { kind: 'leave' };
  if (focus === 'picture') return null;
  const step = shiftKey ? FINE : STEP;
  if (arrow) return { kind: 'move', dx: step * arrow[0], dy: step * arrow[1] };
  switch (key) {
    case 'PageUp':
      return { kind: 'move', dx: 0, dy: -LARGE };
    case 'PageDown':
      return { kind: 'move', dx: 0, dy: LARGE };
    case 'Home':
      return { kind: 'jump', x: 0 };
    case 'End':
      return { kind: 'jump', x: 1 };
    default:
      return null;
  }
}
