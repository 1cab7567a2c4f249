/** Bytes of a file; half open. */
export interface ByteRange {
  readonly start: number;
  readonly end: number;
}
