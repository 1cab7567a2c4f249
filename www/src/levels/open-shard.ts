/** Opens shards as photographs of their own. */

import type { LoadedPhotograph } from '../photo/photograph.js';
import type { PhotoInfo } from '../shared/value-types.js';
import type { LevelTable, ShardId } from './level-table.js';

/**
 * Memory for a pixel beside its tiles: in the page its canvas and the codes that a worker has sent; in the worker its codes,
 * its window origin and the light.
 */
export const BYTES_PER_PIXEL = 20;

/** Memory of a photograph that is drawn. */
export function drawnBytes({ width, height, decodedBytes }: PhotoInfo): number {
  return decodedBytes + BYTES_PER_PIXEL * width * height;
}

/**
 * Opens a shard of `photograph`, the last level, with the first components only, as far as they take at most `maxTileBytes`.
 * `null` if the photograph is no file. Throws `format-invalid` if the shard belongs at another place.
 */
export async function openShard(
  photograph: LoadedPhotograph,
  table: LevelTable,
  id: ShardId,
  maxTileBytes: number,
  signal: AbortSignal,
): Promise<LoadedPhotograph | null> {
  const request = { bytes: table.bytesOf(id), maxTileBytes };
  const shard = (await photograph.openShard?.(request, signal)) ?? null;
  if (!shard) return null;
  try {
    table.checkPlace(id, shard.descriptor);
  } catch (thrown) {
    shard.free();
    throw thrown;
  }
  shard.root = { photograph, scale: 2 ** (table.levels - 1 - id.level) };
  return shard;
}
