/** A photograph in the worker pool: moves its tiles and relights it, one row range in each worker. */

import type { Light } from '../../engine/wasm-exports.js';
import type { PhotoDescriptor, TilesInWorkers, TransferredTile } from '../../photo/types.js';
import { type PhotoError, photoReleased } from '../../shared/errors.js';
import { allSettledOrThrow, withTimeout } from '../../shared/promises.js';
import type { FrameSettings, RelightClient, RowRange, RowRangeCommand } from './protocol.js';

export interface RenderedRows extends RowRange {
  /** RGBA, row by row; valid in view. */
  readonly pixels: ArrayBuffer;
}

/** One worker's rows. */
interface WorkerPart extends TileRowRange {
  readonly client: RelightClient;
  /** The first light row that it needs, and the end of those rows. */
  lightRows: Uint32Array;
  /** The light that it has; `null` if none. */
  light: Light | null;
  /** Memory for its pixels; `null` while the worker has it. */
  pixels: ArrayBuffer | null;
}

export class PoolSession implements TilesInWorkers {
  readonly #width: number;
  readonly #parts: readonly WorkerPart[];
  /** Whether the workers know their light rows; false while tiles are moved. */
  #isPlanned = false;
  readonly #end = new AbortController();

  /** `photo` is its number in the workers; `kernel`, `simd128` or `scalar`, is what these compute with. */
  constructor(
    private readonly photo: number,
    { width, geometry, basis }: PhotoDescriptor,
    clients: readonly RelightClient[],
    ranges: readonly TileRowRange[],
    readonly kernel: string,
    private readonly events: { frameDrawn(): void; ended(): void },
  ) {
    this.#width = width;
    this.#parts = ranges.map((range, i) => {
      const client = clients[i] as RelightClient;
      return { ...range, client, lightRows: new Uint32Array(2), light: null, pixels: null };
    });
    for (const { client, firstRow, rows } of this.#parts) {
      // If this fails, the next request fails too.
      this.#request(client, { kind: 'open', geometry, basis, firstRow, rows }).catch(() => {});
    }
  }

  get size(): number {
    return this.#parts.length;
  }

  /** The failure of a worker, with which its tiles are lost. */
  get failure(): PhotoError | null {
    return this.#parts.find(({ client }) => client.failure)?.client.failure ?? null;
  }

  get tiles(): number[][] {
    return this.#parts.map(({ firstTile, endTile }) =>
      Array.from({ length: endTile - firstTile }, (_, i) => firstTile + i),
    );
  }

  async put(index: number, bytes: TransferredTile): Promise<void> {
    this.#isPlanned = false;
    await this.#request(this.#clientOf(index), { kind: 'put', index, bytes }, [bytes.buffer]);
  }

  async take(index: number): Promise<TransferredTile> {
    this.#isPlanned = false;
    return new Uint8Array(await this.#request(this.#clientOf(index), { kind: 'take', index }));
  }

  async plan(): Promise<void> {
    if (this.#isPlanned) return;
    await allSettledOrThrow(
      this.#parts.map(async (part) => {
        part.light = null;
        part.lightRows = new Uint32Array(await this.#request(part.client, { kind: 'plan' }));
      }),
    );
    this.#isPlanned = true;
  }

  /**
   * Relights the pixels in view. Call it after `plan`, and again only after it has settled: the next call reuses the
   * memory of the pixels. `light` may be freed at once. The same object is not sent to the workers twice.
   */
  async relight(light: Light, settings: FrameSettings): Promise<RenderedRows[]> {
    const { top, bottom } = settings.view;
    const parts = this.#parts.filter(
      (part) => part.firstRow < bottom && top < part.firstRow + part.rows,
    );
    const rowPixels = parts.map((part) => this.#relightPart(part, light, settings));
    const picture = await allSettledOrThrow(rowPixels);
    this.events.frameDrawn();
    return picture;
  }

  async #relightPart(
    part: WorkerPart,
    light: Light,
    settings: FrameSettings,
  ): Promise<RenderedRows> {
    const { firstRow, rows } = part;
    const [first = 0, end = 0] = part.lightRows;
    const rgb =
      light === part.light ? null : (light.linearRgb(first, end) as Float32Array<ArrayBuffer>);
    const memory = part.pixels ?? new ArrayBuffer(4 * this.#width * rows);
    part.pixels = null;
    const task: RowRangeCommand = { kind: 'relight', light: rgb, settings, pixels: memory };
    const pixels = await this.#request(part.client, task, rgb ? [rgb.buffer, memory] : [memory]);
    part.pixels = pixels;
    part.light = light;
    return { firstRow, rows, pixels };
  }

  /** Releases the photograph in the workers and rejects pending requests. */
  end(): void {
    if (this.#end.signal.aborted) return;
    for (const { client } of this.#parts) {
      if (!client.failure) this.#request(client, { kind: 'close' }).catch(() => {});
    }
    this.#end.abort(photoReleased());
    this.events.ended();
  }

  /** Rejects when the session ends; the worker still does the task. */
  async #request(
    client: RelightClient,
    task: RowRangeCommand,
    transfer?: Transferable[],
  ): Promise<ArrayBuffer> {
    const { signal } = this.#end;
    // A worker fails if it is asked for a photograph that it has released.
    signal.throwIfAborted();
    return await withTimeout(client.request({ photo: this.photo, task }, transfer), { signal });
  }

  #clientOf(tile: number): RelightClient {
    const part = this.#parts.find(({ endTile }) => tile < endTile) as WorkerPart;
    return part.client;
  }
}

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
