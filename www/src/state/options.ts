/** The element's options: the values of all its attributes. Immutable: a change makes a new object. */

import { type CssColorParser, type LightColor, parseLightColor } from '../lights/light-color.js';
import type { Backend, CrossOrigin, Gamut, LightName, ToneCurve } from '../shared/names.js';
import { reuse } from '../shared/reuse.js';
import { CENTRE, type PicturePoint, type RgbFactors } from '../shared/values.js';
import type { AttributeReader } from './attribute-reader.js';
import type { Loading, Reveal } from './attribute-values.js';

/** Addresses are absolute; an absent address is `null`. */
export interface ElementOptions {
  readonly src: string | null;
  /** In order of preference; `null` leaves the order to the element. */
  readonly backends: readonly Backend[] | null;
  readonly gamut: Gamut;
  readonly exposure: number;
  readonly whiteBalance: RgbFactors;
  readonly tone: ToneCurve;
  readonly light: LightOptions;
  readonly poster: string | null;
  readonly loading: Loading;
  readonly reveal: Reveal;
  readonly controls: boolean;
  /** The largest magnification; 1 disables zooming. */
  readonly maxZoom: number;
  readonly cooperativeGestures: boolean;
  readonly autoplayLight: boolean;
  /** 0 is never. */
  readonly kioskSeconds: number;
  /** Folder of the WebAssembly modules, ending in a slash; `null` for the one beside the script. */
  readonly wasmUrl: string | null;
  readonly crossOrigin: CrossOrigin;
}

/** The light before a visitor or a script chooses another. */
export interface LightOptions {
  readonly name: LightName;
  /** An image or video that replaces the built-in light. */
  readonly src: string | null;
  readonly crossOrigin: CrossOrigin;
  /** The torch's position; `null` behind the centre of the picture. */
  readonly torch: PicturePoint | null;
  /** The torch's radius; `null` for the default. */
  readonly size: number | null;
  readonly color: LightColor | null;
}

/** Reads all attributes. Objects whose fields are unchanged are taken from `last`. */
export function readOptions(
  reader: AttributeReader,
  last: ElementOptions | null,
  parseColor?: CssColorParser,
): ElementOptions {
  const crossOrigin = reader.read('crossorigin');
  const [x, y] = [reader.read('light-x'), reader.read('light-y')];
  const point = { x: x ?? CENTRE.x, y: y ?? CENTRE.y };
  const light = reuse(last?.light, {
    name: reader.read('light'),
    src: reader.readAddress('light-src'),
    crossOrigin,
    torch: x === null && y === null ? null : reuse(last?.light.torch, point),
    size: reader.read('light-size'),
    color: reader.parse('light-color', (text) => parseLightColor(text, parseColor)),
  });
  return reuse(last, {
    light,
    backends: reader.read('backend'),
    exposure: reader.read('exposure'),
    whiteBalance: reader.read('white-balance'),
    tone: reader.read('tone'),
    gamut: reader.read('gamut'),
    src: reader.readAddress('src'),
    poster: reader.readAddress('poster'),
    loading: reader.read('loading'),
    reveal: reader.read('reveal'),
    controls: reader.has('controls'),
    maxZoom: reader.read('zoom'),
    cooperativeGestures: reader.has('cooperative-gestures'),
    autoplayLight: reader.has('autoplay-light'),
    kioskSeconds: reader.read('kiosk'),
    wasmUrl: reader.readAddress('wasm-url')?.replace(/\/?$/, '/') ?? null,
    crossOrigin,
  });
}
