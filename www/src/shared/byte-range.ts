/** A range of a file's bytes, without the byte at `end`. */
export interface ByteRange {
  readonly start: number;
  readonly end: number;
}
