/** Shows relightable photographs in OpenSeadragon 6. Importing this module has no side effects. */

import { loadPhoto } from './loading/load-photo.js';
import { createRenderer } from './renderers/renderer-factory.js';
import { RelightableTiles, type TileLight, type TileOutput } from './tiles/relightable-tiles.js';
import { TileRenderer } from './tiles/tile-renderer.js';

export type { LightImageSource, LinearImage } from './lights/light-source.js';
export { type ErrorCode, PhotoError } from './shared/errors.js';
export type { LightName, ToneCurve } from './shared/keywords.js';
export type { PhotoInfo } from './shared/value-types.js';
export type { LightOptions } from './state/page-light.js';
export type {
  RelightableTileSource,
  RelightableTiles,
  TileLight,
  TileOutput,
} from './tiles/relightable-tiles.js';

/** Options of `openTiles`. */
export interface TileOptions extends TileOutput {
  /** The first light; `flood` by default. */
  readonly light?: TileLight;
  /** Memory for decoded tiles, in bytes; up to 512 MiB by default, less on devices with little memory. */
  readonly maxBytes?: number;
  /** Whether requests carry cookies, as for `fetch`. */
  readonly credentials?: RequestCredentials;
  /** Cancels opening. */
  readonly signal?: AbortSignal;
}

/**
 * Opens a photograph, for `tileSources` of a viewer. Its server must support range requests if it has several levels. Rejects
 * with a `PhotoError`, a `TypeError` for an invalid light, or with the signal's reason if it is aborted.
 */
export async function openTiles(
  src: string | URL,
  { light = 'flood', maxBytes, credentials = 'same-origin', signal, ...output }: TileOptions = {},
): Promise<RelightableTiles> {
  const url = new URL(src, document.baseURI).href;
  const photograph = await loadPhoto(
    { src: url, credentials },
    {
      signal: signal ?? new AbortController().signal,
      onProgress: () => {},
      onPreview: null,
      onWaiting: () => {},
    },
  );
  const preferences = { backends: ['cpu'], software: false, gamut: 'srgb' } as const;
  const renderer = new TileRenderer(
    photograph,
    (tile, signal) => createRenderer('cpu', tile, preferences, () => {}, signal),
    maxBytes,
  );
  try {
    return new RelightableTiles(renderer, photograph.info, url, light, output);
  } catch (thrown) {
    renderer.free();
    throw thrown;
  }
}
