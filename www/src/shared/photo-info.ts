/** Free of DOM types, because the core's types depend on it. */

/** What the file's index says about a photograph. */
export interface PhotoInfo {
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
}
