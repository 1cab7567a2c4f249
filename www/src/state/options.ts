/** All that a page asks for by attributes. */

import type { Backend, Gamut, ToneCurve } from '../engine/types.js';
import { type CssColorParser, type LightColor, parseLightColor } from '../lights/light-color.js';
import type { LightName } from '../shared/names.js';
import {
  parseExposure,
  parseGamut,
  parseLight,
  parseTone,
  parseWhiteBalance,
} from '../shared/parse-settings.js';
import type { PicturePoint, RgbFactors } from '../shared/values.js';
import type { Attributes } from './attribute-reader.js';
import {
  type Loading,
  parseAddress,
  parseBackends,
  parseCoordinate,
  parseCrossOrigin,
  parseKiosk,
  parseLoading,
  parseReveal,
  parseTorchSize,
  parseZoom,
  type Reveal,
} from './attribute-values.js';

/** See the module. Addresses are absolute. */
export interface Asked {
  readonly src: string | null;
  /** `null` where the page leaves the order to the element. */
  readonly backends: readonly Backend[] | null;
  readonly gamut: Gamut;
  readonly exposure: number;
  readonly whiteBalance: RgbFactors;
  readonly tone: ToneCurve;
  readonly light: AskedLight;
  readonly poster: string | null;
  readonly loading: Loading;
  readonly reveal: Reveal;
  readonly controls: boolean;
  /** The furthest magnification; 1 is none. */
  readonly zoom: number;
  readonly cooperative: boolean;
  /** Whether the torch is to wander by itself. */
  readonly breathes: boolean;
  /** Seconds; 0 is never. */
  readonly kiosk: number;
  /** Folder of the WebAssembly modules, with a slash at its end; `null` for the one beside the script. */
  readonly wasm: string | null;
  readonly crossOrigin: 'anonymous' | 'use-credentials' | null;
}

/** The light to begin with. */
export interface AskedLight {
  readonly name: LightName;
  /** A picture or film in its place. */
  readonly src: string | null;
  /** Where a torch shines; `null` over the middle of the light. */
  readonly place: PicturePoint | null;
  /** Radius of a torch; `null` for the usual one. */
  readonly size: number | null;
  readonly color: LightColor | null;
}

/** What attributes are read from. */
export interface AttributeSource {
  readonly baseURI: string;
  getAttribute(name: string): string | null;
}

/** Reads all of them. What is wrong is told by `attributes`. */
export function readAsked(
  element: AttributeSource,
  attributes: Attributes,
  readColor: CssColorParser,
): Asked {
  const read = <T>(name: string, parse: (value: string | null, name: string) => T): T =>
    attributes.read(name, element.getAttribute(name), (value) => parse(value, name));
  const address = (value: string | null, name: string) =>
    parseAddress(value, name, element.baseURI);
  const has = (name: string) => element.getAttribute(name) !== null;
  const [x, y] = [read('light-x', parseCoordinate), read('light-y', parseCoordinate)];
  return {
    light: {
      name: read('light', parseLight),
      src: read('light-src', address),
      place: x === null && y === null ? null : { x: x ?? 0.5, y: y ?? 0.5 },
      size: read('light-size', parseTorchSize),
      color: read('light-color', (value) => parseLightColor(value, readColor)),
    },
    backends: read('backend', parseBackends),
    exposure: read('exposure', parseExposure),
    whiteBalance: read('white-balance', parseWhiteBalance),
    tone: read('tone', parseTone),
    gamut: read('gamut', parseGamut),
    src: read('src', address),
    poster: read('poster', address),
    loading: read('loading', parseLoading),
    reveal: read('reveal', parseReveal),
    controls: has('controls'),
    zoom: read('zoom', parseZoom),
    cooperative: has('cooperative-gestures'),
    breathes: has('autoplay-light'),
    kiosk: read('kiosk', parseKiosk),
    wasm: read('wasm-url', folder(address)),
    crossOrigin: parseCrossOrigin(element.getAttribute('crossorigin')),
  };
}

type ParseAddress = (value: string | null, name: string) => string | null;

function folder(address: ParseAddress): ParseAddress {
  return (value, name) => {
    const url = address(value, name);
    return url === null || url.endsWith('/') ? url : `${url}/`;
  };
}
