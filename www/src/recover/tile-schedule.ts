/**
 * Which worker recovers which tile. Tile workers have the photographs' rows of one row of tiles at a time and take these
 * from the top; the coordinator has all rows and takes tiles from the bottom. What a lost worker has not finished goes to
 * the others.
 */

import { Deferred } from '../shared/promises.js';

export class TileSchedule {
  /** Tiles that nobody recovers. */
  readonly #waiting: Set<number>;
  readonly #unfinished: Set<number>;
  /** Rows of tiles that tile workers have. */
  readonly #claimedRows = new Set<number>();
  #change = new Deferred();

  constructor(
    private readonly tiles: number,
    private readonly columns: number,
  ) {
    this.#waiting = new Set(Array.from({ length: tiles }, (_, tile) => tile));
    this.#unfinished = new Set(this.#waiting);
  }

  get isFinished(): boolean {
    return this.#unfinished.size === 0;
  }

  /** The share of the tiles that are recovered, 0 to 1. */
  get share(): number {
    return 1 - this.#unfinished.size / this.tiles;
  }

  /** Resolves when tiles come back, or all are finished. */
  get changed(): Promise<void> {
    return this.#change.promise;
  }

  /** The first row with waiting tiles that no worker has; `undefined` if there is none. */
  claimRow(): number | undefined {
    for (const tile of this.#waiting) {
      const row = this.#rowOf(tile);
      if (this.#claimedRows.has(row)) continue;
      this.#claimedRows.add(row);
      return row;
    }
    return undefined;
  }

  releaseRow(row: number): void {
    this.#claimedRows.delete(row);
  }

  /** Takes a waiting tile of a row. */
  takeFromRow(row: number): number | undefined {
    return this.#take([...this.#waiting].find((tile) => this.#rowOf(tile) === row));
  }

  /** Takes the last waiting tile, if possible of a row that no worker has. */
  takeAny(): number | undefined {
    const last = [...this.#waiting].sort((a, b) => b - a);
    const free = last.find((tile) => !this.#claimedRows.has(this.#rowOf(tile)));
    return this.#take(free ?? last[0]);
  }

  finish(tile: number): void {
    this.#unfinished.delete(tile);
    if (this.isFinished) this.#announce();
  }

  /** Returns a tile that its worker did not finish. */
  giveBack(tile: number): void {
    this.#waiting.add(tile);
    this.#announce();
  }

  #rowOf(tile: number): number {
    return Math.floor(tile / this.columns);
  }

  #take(tile: number | undefined): number | undefined {
    if (tile !== undefined) this.#waiting.delete(tile);
    return tile;
  }

  #announce(): void {
    this.#change.resolve();
    this.#change = new Deferred();
  }
}
