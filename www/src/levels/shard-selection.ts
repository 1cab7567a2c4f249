/** Which shards a view needs, and which of those in memory it shows. */

import type { PixelRect } from '../shared/value-types.js';
import type { LevelTable, ShardId } from './level-table.js';

/** The visible part of a picture, in pixels of level 0. */
export interface PictureView {
  readonly rect: PixelRect;
  /** The part in the element's box, with what lies beyond the window. */
  readonly box: PixelRect;
  /** Device pixels along the side of a pixel of level 0. */
  readonly scale: number;
}

export interface ShardSelection {
  /** The level that the frame should have; that of the root if it suffices. */
  readonly level: number;
  /** The shards to load, the most urgent first. Some of them may be in memory. */
  readonly needed: readonly ShardId[];
  /** Whether all shards of the level are in memory. */
  readonly isComplete: boolean;
  /** Whether the coarser level that was asked for is not in memory yet. */
  readonly isPending: boolean;
}

/** Coarser by this many levels comes first where the next coarser level does not fit: a sixteenth of the bytes. */
const OVERVIEW_STEPS = 2;

/**
 * A view that needs more than `maxShards` gets a coarser level. The level after it comes first, as it has a quarter of the
 * bytes, and stays if there is room: with `isCoarse` a frame has that, for which others make room.
 */
export function selectShards(
  table: LevelTable,
  { rect, scale }: Pick<PictureView, 'rect' | 'scale'>,
  isLoaded: (shard: ShardId) => boolean,
  maxShards: number,
  isCoarse: boolean,
): ShardSelection {
  const root = table.levels - 1;
  // Between 0.7 and 1.4 pixels of the level for a device pixel.
  let level = Math.min(root, Math.max(0, Math.round(-Math.log2(scale))));
  let shards = table.shardsIn(level, rect);
  while (shards.length > maxShards) {
    level += 1;
    shards = table.shardsIn(level, rect);
  }
  const isComplete = shards.every(isLoaded);
  const coarse = table.shardsIn(level + 1, rect);
  const hasRoom = shards.length + coarse.length <= maxShards;
  const overview = isComplete ? [] : table.shardsIn(level + OVERVIEW_STEPS, rect);
  const first = hasRoom || isCoarse ? coarse : overview;
  const fine = nearestFirst(table, shards, rect);
  const needed = [...first, ...fine.slice(0, isCoarse ? maxShards - coarse.length : undefined)];
  if (!isCoarse || level === root) return { level, needed, isComplete, isPending: false };
  const isPending = !coarse.every(isLoaded);
  if (isPending) return { level, needed, isComplete, isPending };
  return { level: level + 1, needed, isComplete: true, isPending };
}

/** Whether two parts of the picture have pixels in common. */
export function overlap(a: PixelRect, b: PixelRect): boolean {
  return a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
}

/** Whether all pixels of `b` are in `a`. */
export function contains(a: PixelRect, b: PixelRect): boolean {
  return a.left <= b.left && b.right <= a.right && a.top <= b.top && b.bottom <= a.bottom;
}

function nearestFirst(table: LevelTable, shards: readonly ShardId[], view: PixelRect) {
  const centre = ({ left, top, right, bottom }: PixelRect) => [left + right, top + bottom];
  const [x = 0, y = 0] = centre(view);
  const distance = (shard: ShardId) => {
    const [u = 0, v = 0] = centre(table.rectOf(shard));
    return Math.hypot(u - x, v - y);
  };
  return [...shards].sort((a, b) => distance(a) - distance(b));
}
