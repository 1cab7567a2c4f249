/** The core's photograph. This file must not use DOM types, because the package exports its types. */

/** A photograph in memory, until it is freed. */
export interface CorePhotograph {
  /** The picture's width in pixels. */
  readonly width: number;
  /** The picture's height in pixels. */
  readonly height: number;
  /** The light plane's width in light elements. */
  readonly lightWidth: number;
  /** The light plane's height in light elements. */
  readonly lightHeight: number;
  /** Memory that the decoded light transport matrix takes, in bytes. */
  readonly decodedBytes: number;
  /** The file's metadata, a JSON object. */
  readonly metadata: unknown;
  /** Frees its memory. */
  free(): void;
}
