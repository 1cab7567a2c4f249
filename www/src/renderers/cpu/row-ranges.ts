/** Splits a photograph into row ranges, one for each worker. */

import type { PhotoDescriptor } from '../../photo/types.js';
import type { RowRange } from './protocol.js';

/** Whole rows of tiles. */
export interface TileRowRange extends RowRange {
  readonly firstTile: number;
  readonly endTile: number;
}

/** At most `maxRanges` row ranges, which have about the same height. */
export function splitRows(
  { width, height, tileSide }: PhotoDescriptor,
  maxRanges: number,
): TileRowRange[] {
  const columns = Math.ceil(width / tileSide);
  const tileRows = Math.ceil(height / tileSide);
  const count = Math.min(maxRanges, tileRows);
  return Array.from({ length: count }, (_, i) => {
    const first = Math.round((i * tileRows) / count);
    const end = Math.round(((i + 1) * tileRows) / count);
    const firstRow = first * tileSide;
    return {
      firstRow,
      rows: Math.min(end * tileSide, height) - firstRow,
      firstTile: first * columns,
      endTile: end * columns,
    };
  });
}
