/** Reflects attributes as typed properties. An absent or invalid attribute gives the property's default. */

import { CENTRE } from '../shared/value-types.js';
import {
  DEFAULT_TORCH_SIZE,
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
  /** Address of an image or video that replaces the built-in light. */
  lightSrc: string;
  /** CSS colour of the light. */
  lightColor: string;
  /** Radius of the torch, as a fraction of the light plane's shorter side. */
  lightSize: number;
  /** Initial position of the torch, 0 to 1 across the picture. */
  lightX: number;
  /** Initial position of the torch, 0 to 1 down the picture. */
  lightY: number;
  /** Factor on the brightness. */
  exposure: number;
  /** Factors on red, green and blue, separated by spaces. */
  whiteBalance: string;
  /** Tone curve: `clip` cuts brightness off at white, `filmic` compresses highlights. */
  tone: string;
  /** Colour space of the canvas: `srgb` or `display-p3`. */
  gamut: string;
  /** Backends to try, in order, separated by spaces. */
  backend: string;
  /** Address of an image that is shown until the photograph is drawn, and if it cannot be drawn. */
  poster: string;
  /** When the photograph is fetched, as on `<img>`: `eager` at once, `lazy` within one screen of the viewport. */
  loading: LoadingMode;
  /** When the poster gives way: `auto` when the photograph is drawn, `interaction` on a press, `manual` by `dismissPoster()`. */
  reveal: RevealMode;
  /** Whether the toolbar is shown. */
  controls: boolean;
  /** Largest magnification; 1 disables zooming. */
  zoom: number;
  /** Whether the wheel and single fingers scroll the page. */
  cooperativeGestures: boolean;
  /** Whether the torch wanders while there is no input. */
  autoplayLight: boolean;
  /** Seconds without input before the element resets itself; 0 is never. */
  kiosk: number;
  /** CORS mode of requests, as on images. */
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
  zoom: number('zoom'),
  cooperativeGestures: flag('cooperative-gestures'),
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
  attribute: 'light-size' | 'light-x' | 'light-y' | 'exposure' | 'zoom' | 'kiosk',
  defaultValue = 0,
): AttributeConverter<number> {
  const { get, set } = parsed(attribute);
  return { attribute, get: (text) => get(text) ?? defaultValue, set };
}
