/** A file's metadata: what a page uses of it. */

import { PhotoError } from '../shared/errors.js';
import type { ColorMatrix } from '../shared/value-types.js';

const IDENTITY: ColorMatrix = [
  [1, 0, 0],
  [0, 1, 0],
  [0, 0, 1],
];
/** Largest factor of a colour matrix, as the format has it. */
const MAX_FACTOR = 1000;

/** Throws `format-invalid`. */
export function parseMetadata(json: string): Readonly<Record<string, unknown>> {
  try {
    const metadata: unknown = JSON.parse(json);
    if (typeof metadata === 'object' && metadata !== null && !Array.isArray(metadata)) {
      return metadata as Record<string, unknown>;
    }
  } catch {
    // Not JSON.
  }
  throw invalid('is not a JSON object');
}

/** The identity if the photograph has none: its primaries are those of sRGB. Throws `format-invalid`. */
export function parseColorMatrix(value: unknown): ColorMatrix {
  if (value === undefined) return IDENTITY;
  const isFactor = (factor: unknown) =>
    typeof factor === 'number' && Math.abs(factor) <= MAX_FACTOR;
  const isTriple = (row: unknown, isEntry: (entry: unknown) => boolean) =>
    Array.isArray(row) && row.length === 3 && row.every(isEntry);
  if (isTriple(value, (row) => isTriple(row, isFactor))) return value as ColorMatrix;
  throw invalid(`has a color_matrix that is not three rows of three factors up to ${MAX_FACTOR}`);
}

function invalid(what: string): PhotoError {
  return new PhotoError('format-invalid', `The file's metadata ${what}. Export it again.`);
}
