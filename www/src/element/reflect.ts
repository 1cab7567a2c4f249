/** Attributes as typed properties: what the attribute says, or what goes without saying. */

import { parseExposure } from '../shared/parse-settings.js';
import {
  DEFAULT_TORCH_SIZE,
  type Loading,
  parseCoordinate,
  parseCrossOrigin,
  parseKiosk,
  parseLoading,
  parseReveal,
  parseTorchSize,
  parseZoom,
  type Reveal,
} from '../state/attribute-values.js';

/** The properties. Numbers and names are those that go without saying where the attribute is wrong. */
export interface Reflected {
  /** Address of the `.ltm` file. */
  src: string;
  /** What the picture shows, in words. */
  alt: string;
  /** Name of the built-in light to begin with; `activeLight` is the one that shines. */
  light: string;
  /** Address of a picture or film that is the light in place of the built-in one. */
  lightSrc: string;
  /** Any CSS colour, by which the light is tinted. */
  lightColor: string;
  /** Radius of the torch, as a fraction of the light plane's shorter side. */
  lightSize: number;
  /** Where the torch shines to begin with, 0 to 1 across the picture. */
  lightX: number;
  /** The same, 0 to 1 down the picture. */
  lightY: number;
  /** Factor on the light's brightness. */
  exposure: number;
  /** Factors on red, green and blue. */
  whiteBalance: string;
  /** What becomes of brightness: `clip`, cut off at white, or `filmic`, rolled off before it. */
  tone: string;
  /** Colours that the canvas is to show: `srgb` or `display-p3`. */
  gamut: string;
  /** Back ends to try, in order, parted by spaces. */
  backend: string;
  /** Address of a picture that is shown until the photograph is drawn, and where it cannot be. */
  poster: string;
  /** When the photograph is fetched: once it is near the screen, once it is in view, or at once. */
  loading: Loading;
  /** When the poster gives way: once the photograph is drawn, once it is pressed, or by `dismissPoster`. */
  reveal: Reveal;
  /** Whether there are buttons. */
  controls: boolean;
  /** The furthest magnification; 1 is none. */
  zoom: number;
  /** Whether the wheel and single fingers are left to the page. */
  cooperativeGestures: boolean;
  /** Whether the torch wanders by itself while nobody moves it. */
  autoplayLight: boolean;
  /** Seconds without a visitor after which everything is as it was; 0 is never. */
  kiosk: number;
  /** Address of the folder of the WebAssembly modules; empty for the one beside the script. */
  wasmUrl: string;
  /** How files of other origins are asked for, as on images. */
  crossOrigin: 'anonymous' | 'use-credentials' | null;
}

/** How an attribute is a property. */
interface Reflection<T> {
  readonly attribute: string;
  get(value: string | null): T;
  /** `null` takes the attribute away. */
  set(value: T): string | null;
}

const REFLECTED: { readonly [P in keyof Reflected]: Reflection<Reflected[P]> } = {
  src: text('src'),
  alt: text('alt'),
  light: text('light', 'flood'),
  lightSrc: text('light-src'),
  lightColor: text('light-color', 'white'),
  lightSize: parsed('light-size', (value) => parseTorchSize(value) ?? DEFAULT_TORCH_SIZE),
  lightX: parsed('light-x', (value) => parseCoordinate(value, 'light-x') ?? 0.5),
  lightY: parsed('light-y', (value) => parseCoordinate(value, 'light-y') ?? 0.5),
  exposure: parsed('exposure', parseExposure),
  whiteBalance: text('white-balance', '1 1 1'),
  tone: text('tone', 'clip'),
  gamut: text('gamut', 'srgb'),
  backend: text('backend', 'webgpu webgl2 cpu'),
  poster: text('poster'),
  loading: parsed('loading', parseLoading),
  reveal: parsed('reveal', parseReveal),
  controls: flag('controls'),
  zoom: parsed('zoom', parseZoom),
  cooperativeGestures: flag('cooperative-gestures'),
  autoplayLight: flag('autoplay-light'),
  kiosk: parsed('kiosk', parseKiosk),
  wasmUrl: text('wasm-url'),
  crossOrigin: { attribute: 'crossorigin', get: parseCrossOrigin, set: (value) => value },
};

/** What an element has to observe. */
export const ATTRIBUTES: readonly string[] = Object.values(REFLECTED).map(
  ({ attribute }) => attribute,
);

/** The properties' names. */
export const PROPERTIES = Object.keys(REFLECTED) as readonly (keyof Reflected)[];

/** Gives a class of elements the properties. */
export function reflect(prototype: object): void {
  for (const [property, reflection] of Object.entries(REFLECTED)) {
    // Each of them takes what its own type is.
    const { attribute, get, set } = reflection as Reflection<unknown>;
    Object.defineProperty(prototype, property, {
      configurable: true,
      enumerable: true,
      get(this: Element) {
        return get(this.getAttribute(attribute));
      },
      set(this: Element, value: unknown) {
        const written = set(value);
        if (written === null) this.removeAttribute(attribute);
        else this.setAttribute(attribute, written);
      },
    });
  }
}

function text(attribute: string, otherwise = ''): Reflection<string> {
  return { attribute, get: (value) => value ?? otherwise, set: String };
}

function flag(attribute: string): Reflection<boolean> {
  return { attribute, get: (value) => value !== null, set: (value) => (value ? '' : null) };
}

function parsed<T>(attribute: string, parse: (value: string | null) => T): Reflection<T> {
  return {
    attribute,
    get: (value) => {
      try {
        return parse(value);
      } catch {
        return parse(null);
      }
    },
    set: String,
  };
}
