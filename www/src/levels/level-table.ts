/** The levels of a photograph, and their shards: which pixels each has, and which bytes of the file. */

import { PhotoError } from '../shared/errors.js';
import type { ByteRange, PixelRect } from '../shared/value-types.js';

/** A square part of a level. Level 0 is the finest. */
export interface ShardId {
  readonly level: number;
  /** Column and row, in shards. */
  readonly x: number;
  readonly y: number;
}

/** In pixels. */
interface PictureSize {
  readonly width: number;
  readonly height: number;
}

/** Pixels around those in view that are drawn too, as the view may move until the frame is shown. */
const MARGIN = 32;

/** The numbers before those of the shards, and those of each shard. */
const FIXED_NUMBERS = 6;
const SHARD_NUMBERS = 5;

export class LevelTable {
  /** Of level 0, in pixels. */
  readonly width: number;
  readonly height: number;
  /** Number of levels. The last, the root, is a photograph by itself. */
  readonly levels: number;
  /** In pixels. */
  readonly shardSide: number;
  readonly #lightWidth: number;
  readonly #lightHeight: number;
  readonly #bytes = new Map<string, ByteRange>();

  /** `numbers` are those of `Decoder.levels`. */
  constructor(numbers: Float64Array) {
    const [width = 1, height = 1, lightWidth = 1, lightHeight = 1, levels = 1, shardSide = 1] =
      numbers;
    this.#lightWidth = lightWidth;
    this.#lightHeight = lightHeight;
    this.width = width;
    this.height = height;
    this.levels = levels;
    this.shardSide = shardSide;
    for (let at = FIXED_NUMBERS; at < numbers.length; at += SHARD_NUMBERS) {
      const [level = 0, x = 0, y = 0, start = 0, end = 0] = numbers.subarray(
        at,
        at + SHARD_NUMBERS,
      );
      this.#bytes.set(keyOf({ level, x, y }), { start, end });
    }
  }

  /** The shards of a level, other than the root's, with pixels of `rect`, row by row. */
  shardsIn(level: number, { left, top, right, bottom }: PixelRect): ShardId[] {
    if (level >= this.levels - 1) return [];
    const side = this.shardSide * 2 ** level;
    const range = (start: number, end: number, pixels: number) => {
      const first = Math.max(0, Math.floor(start / side));
      const length = Math.max(0, Math.ceil(Math.min(end, pixels) / side) - first);
      return Array.from({ length }, (_, i) => first + i);
    };
    const columns = range(left, right, this.width);
    return range(top, bottom, this.height).flatMap((y) => columns.map((x) => ({ level, x, y })));
  }

  /** All pixels of level 0. */
  get picture(): PixelRect {
    return { left: 0, top: 0, right: this.width, bottom: this.height };
  }

  /** Its pixels, on level 0. */
  rectOf({ level, x, y }: ShardId): PixelRect {
    const side = this.shardSide * 2 ** level;
    const [left, top] = [x * side, y * side];
    return { left, top, right: left + side, bottom: top + side };
  }

  /** The pixels of a shard, which has this size, in a part of the picture and a little around it. `part` is in level 0. */
  pixelsIn(part: PixelRect, shard: ShardId, { width, height }: PictureSize): PixelRect {
    const { left, top } = this.rectOf(shard);
    const pixel = (at: number, first: number, side: number) =>
      Math.min(side, Math.max(0, Math.round((at - first) / 2 ** shard.level)));
    const margin = MARGIN * 2 ** shard.level;
    return {
      left: pixel(part.left - margin, left, width),
      top: pixel(part.top - margin, top, height),
      right: pixel(part.right + margin, left, width),
      bottom: pixel(part.bottom + margin, top, height),
    };
  }

  /** Throws `format-invalid` if a photograph is not the shard with this name. `geometry` is as the decoder packs it. */
  checkPlace(
    shard: ShardId,
    { width, height, geometry }: PictureSize & { readonly geometry: Float64Array },
  ): void {
    const scale = 2 ** shard.level;
    const levelOf = (side: number) => Math.ceil(side / scale);
    const [left, top] = [shard.x * this.shardSide, shard.y * this.shardSide];
    const expected = [
      Math.min(this.shardSide, levelOf(this.width) - left),
      Math.min(this.shardSide, levelOf(this.height) - top),
      ...[left, top, levelOf(this.#lightWidth), levelOf(this.#lightHeight)],
    ];
    const found = [width, height, geometry[6], geometry[7], geometry[10], geometry[11]];
    if (expected.every((value, i) => value === found[i])) return;
    const message = `The shard ${shard.x}, ${shard.y} of level ${shard.level} belongs at another place. Export the file again.`;
    throw new PhotoError('format-invalid', message);
  }

  /** Its bytes in the file. */
  bytesOf(shard: ShardId): ByteRange {
    return this.#bytes.get(keyOf(shard)) as ByteRange;
  }
}

export function keyOf({ level, x, y }: ShardId): string {
  return `${level} ${x} ${y}`;
}
