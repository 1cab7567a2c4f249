/** The element's options: the values of all its attributes. Immutable: a change makes a new object. */

import { parseLightColor } from '../lights/light-color.js';
import { reuse } from '../shared/reuse-if-equal.js';
import { CENTRE, type PicturePoint } from '../shared/value-types.js';
import { EMPTY_ZOOM, MAX_ZOOM } from './attribute-parsers.js';
import type { AttributeReader } from './attribute-reader.js';

/** A pixel of the picture can fill one of a screen where the box of the picture has at least so many. */
const MIN_BOX_PIXELS = 1024;

/** As `PARSERS` gives them. Addresses are absolute; an absent address is `null`. */
export type ElementOptions = Readonly<ReturnType<typeof readAttributes>>;

/** The light before a visitor or a script chooses another. */
export type LightAttributes = Readonly<ReturnType<typeof readLight>>;

/**
 * Reads all attributes. Objects whose fields are unchanged are taken from `last`. `side` is the longer one of the
 * picture, in pixels; 0 if it is not known.
 */
export function readOptions(
  reader: AttributeReader,
  last: ElementOptions | null,
  side = 0,
): ElementOptions {
  const options = readAttributes(reader, side);
  const torch = options.light.torch && reuse(last?.light.torch, options.light.torch);
  const light = reuse(last?.light, { ...options.light, torch });
  return reuse(last, { ...options, light });
}

function readAttributes(reader: AttributeReader, side: number) {
  return {
    light: readLight(reader),
    backends: reader.read('backend'),
    exposure: reader.read('exposure'),
    whiteBalance: reader.read('white-balance'),
    tone: reader.read('tone'),
    gamut: reader.read('gamut'),
    src: reader.readAddress('src'),
    width: reader.read('width'),
    height: reader.read('height'),
    poster: reader.readAddress('poster'),
    loading: reader.read('loading'),
    reveal: reader.read('reveal'),
    controls: reader.has('controls'),
    maxZoom:
      reader.read('zoom') ?? (side > 0 ? Math.max(EMPTY_ZOOM, side / MIN_BOX_PIXELS) : MAX_ZOOM),
    cooperativeGestures: reader.has('cooperative-gestures'),
    minimap: reader.has('minimap'),
    autoplayLight: reader.has('autoplay-light'),
    kioskSeconds: reader.read('kiosk'),
    crossOrigin: reader.read('crossorigin'),
  };
}

function readLight(reader: AttributeReader) {
  const [x, y] = [reader.read('light-x'), reader.read('light-y')];
  const point: PicturePoint = { x: x ?? CENTRE.x, y: y ?? CENTRE.y };
  return {
    name: reader.read('light'),
    /** An image or video that replaces the built-in light. */
    src: reader.readAddress('light-src'),
    crossOrigin: reader.read('crossorigin'),
    /** The torch's position; `null` behind the centre of the picture. */
    torch: x === null && y === null ? null : point,
    size: reader.read('light-size'),
    color: reader.parse('light-color', parseLightColor),
  };
}
