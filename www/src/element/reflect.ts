/** Reflects attributes as typed properties. An absent or invalid attribute gives the property's default. */

import { CENTRE } from '../shared/value-types.js';
import {
  DEFAULT_TORCH_SIZE,
  EMPTY_ZOOM,
  type LoadingMode,
  type PARSERS,
  type ParsedValue,
  parserOf,
  type RevealMode,
} from '../state/attribute-parsers.js';

/** The properties that reflect attributes. */
export interface ReflectedProperties {
  /** Address of the `.ltm` file. */
  src: string;
  /** Description of the picture for visitors who cannot see it. */
  alt: string;
  /**
   * Width of the element in CSS pixels, as on `<img>`; with `height`, it keeps the place before the photograph is there.
   */
  width: number;
  /** Height of the element in CSS pixels, as on `<img>`. */
  height: number;
  /**
   * Address of an image or video that replaces the built-in light. A path that ends in mp4, m4v, webm, ogv or mov is a
   * video, which plays muted, in a loop.
   */
  lightSrc: string;
  /** Any CSS colour; it tints the light. */
  lightColor: string;
  /** Radius of the torch, as a fraction of the light plane's shorter side; 1/7 by default. */
  lightSize: number;
  /**
   * Initial position of the torch, 0 to 1 across the picture. Without `light-x` and `light-y` it is the middle of the
   * light plane.
   */
  lightX: number;
  /** Initial position of the torch, 0 to 1 down the picture. */
  lightY: number;
  /** Factor on the brightness; 1 by default. */
  exposure: number;
  /** Factors on red, green and blue, separated by spaces; `1 1 1` by default. */
  whiteBalance: string;
  /** Tone curve: `clip` (default) cuts brightness off at white, `filmic` compresses highlights and is darker. */
  tone: string;
  /**
   * Colour space of the canvas: `srgb` (default), or `display-p3`, which shows more saturated bright colours on screens
   * that have them.
   */
  gamut: string;
  /**
   * Backends to try, in order; `webgpu webgl2 cpu` by default, without software renderers, as the CPU backend is
   * faster.
   */
  backend: string;
  /** Address of an image that is shown until the photograph is drawn, and if it cannot be drawn. */
  poster: string;
  /** When the photograph is fetched, as on `<img>`: `eager` (default) at once, `lazy` within one screen of the viewport. */
  loading: LoadingMode;
  /**
   * When the poster gives way: `auto` (default) when the photograph is drawn; `interaction` when the visitor presses
   * it, which also starts the download; `manual` when the page calls `dismissPoster()`.
   */
  reveal: RevealMode;
  /** Shows buttons: lights, play and pause, zoom, reset, tilt (on hand-held devices), full screen. */
  controls: boolean;
  /**
   * Largest magnification; if the attribute has no value 8, or as much as shows the pixels of a larger picture. Without the
   * attribute, and at 1, the picture does not zoom.
   */
  zoom: number;
  /**
   * With `zoom`: the wheel zooms with Ctrl or ⌘ only, one finger scrolls the page, two fingers zoom; a hint says so.
   */
  cooperativeGestures: boolean;
  /** Shows an overview while the picture is magnified, in which the visitor can point at another part. */
  minimap: boolean;
  /** The torch wanders slowly until a visitor takes it, and again after eight seconds without input. */
  autoplayLight: boolean;
  /** Resets everything after this many seconds without input; 60 if the attribute has no value, never at 0. */
  kiosk: number;
  /** CORS mode of the requests for `src`, `light-src` and `poster`, as on `<img>`. */
  crossOrigin: 'anonymous' | 'use-credentials' | null;
}

/** Converts between an attribute and a property. */
interface AttributeConverter<T> {
  readonly attribute: string;
  get(text: string | null): T;
  /** `null` removes the attribute. */
  set(value: T): string | null;
}

const REFLECTED: {
  readonly [P in keyof ReflectedProperties]: AttributeConverter<ReflectedProperties[P]>;
} = {
  src: text('src'),
  alt: text('alt'),
  width: number('width'),
  height: number('height'),
  lightSrc: text('light-src'),
  lightColor: text('light-color', 'white'),
  lightSize: number('light-size', DEFAULT_TORCH_SIZE),
  lightX: number('light-x', CENTRE.x),
  lightY: number('light-y', CENTRE.y),
  exposure: number('exposure'),
  whiteBalance: text('white-balance', '1 1 1'),
  tone: text('tone', 'clip'),
  gamut: text('gamut', 'srgb'),
  backend: text('backend', 'webgpu webgl2 cpu'),
  poster: text('poster'),
  loading: parsed('loading'),
  reveal: parsed('reveal'),
  controls: flag('controls'),
  zoom: number('zoom', EMPTY_ZOOM),
  cooperativeGestures: flag('cooperative-gestures'),
  minimap: flag('minimap'),
  autoplayLight: flag('autoplay-light'),
  kiosk: number('kiosk'),
  crossOrigin: { ...parsed('crossorigin'), set: (value) => value },
};

/** `light` has a property of its own, which takes more than text. */
export const ATTRIBUTES = [...Object.values(REFLECTED).map(({ attribute }) => attribute), 'light'];
export const PROPERTIES = Object.keys(REFLECTED) as readonly (keyof ReflectedProperties)[];

/** Defines the properties on the prototype of an element class. */
export function reflect(prototype: object): void {
  for (const [property, reflection] of Object.entries(REFLECTED)) {
    const { attribute, get, set } = reflection as AttributeConverter<unknown>;
    Object.defineProperty(prototype, property, {
      configurable: true,
      enumerable: true,
      get(this: Element) {
        return get(this.getAttribute(attribute));
      },
      set(this: Element, value: unknown) {
        const text = set(value);
        if (text === null) this.removeAttribute(attribute);
        else this.setAttribute(attribute, text);
      },
    });
  }
}

function text(attribute: string, defaultValue = ''): AttributeConverter<string> {
  return { attribute, get: (text) => text ?? defaultValue, set: String };
}

function flag(attribute: string): AttributeConverter<boolean> {
  return { attribute, get: (text) => text !== null, set: (value) => (value ? '' : null) };
}

function parsed<K extends keyof typeof PARSERS>(attribute: K): AttributeConverter<ParsedValue<K>> {
  const parse = parserOf(attribute);
  const get = (text: string | null) => {
    try {
      return parse(text);
    } catch {
      return parse(null);
    }
  };
  return { attribute, get, set: String };
}

function number(
  attribute:
    | 'width'
    | 'height'
    | 'light-size'
    | 'light-x'
    | 'light-y'
    | 'exposure'
    | 'zoom'
    | 'kiosk',
  defaultValue = 0,
): AttributeConverter<number> {
  const { get, set } = parsed(attribute);
  return { attribute, get: (text) => get(text) ?? defaultValue, set };
}
