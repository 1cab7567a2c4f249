/** Recovers all tiles, in the coordinator and in tile workers at the same time. */

import type { PackedRows } from './protocol.js';
import type { RecoveryClient } from './recovery-client.js';
import { TileSchedule } from './tile-schedule.js';

type Client = Pick<RecoveryClient, 'call' | 'ready' | 'terminate'>;

/** Rows that were requested before the worker needs them, so that it does not wait; `null` if it has all. */
interface ClaimedRow {
  readonly row: number;
  readonly rows: Promise<PackedRows> | null;
}

/** A worker, and whether it has prepared the recovery itself and therefore has all rows. */
export interface TileHelper {
  readonly worker: Client;
  readonly isPrepared: Promise<boolean>;
}

/**
 * `onTile` gets the share of the tiles that are done. Tile workers that fail are left out; rejects if the coordinator
 * fails. Ends the tile workers.
 */
export async function recoverTiles(
  coordinator: Client,
  helpers: readonly TileHelper[],
  { tiles, tileColumns }: { readonly tiles: number; readonly tileColumns: number },
  onTile: (share: number) => void,
): Promise<void> {
  const schedule = new TileSchedule(tiles, tileColumns);
  const finish = (tile: number): void => {
    schedule.finish(tile);
    onTile(schedule.share);
  };
  try {
    for (const helper of helpers) void help(coordinator, helper, schedule, finish);
    while (!schedule.isFinished) {
      const tile = schedule.takeAny();
      if (tile === undefined) {
        await schedule.changed;
        continue;
      }
      await coordinator.call('recoverTile', [tile]);
      finish(tile);
    }
  } finally {
    for (const { worker } of helpers) worker.terminate();
  }
}

/** Never rejects: after a failure, the tiles of the worker go to the others. */
async function help(
  coordinator: Client,
  helper: TileHelper,
  schedule: TileSchedule,
  finish: (tile: number) => void,
): Promise<void> {
  const { worker } = helper;
  let hasAllRows = false;
  let claimed: ClaimedRow | null = null;
  let row: number | null = null;
  let tile: number | undefined;
  const claim = (): ClaimedRow | null => {
    const next = schedule.claimRow();
    if (next === undefined) return null;
    const rows = hasAllRows ? null : coordinator.call('packRows', [next]);
    rows?.catch(() => {});
    return { row: next, rows };
  };
  try {
    await worker.ready();
    hasAllRows = await helper.isPrepared;
    if (schedule.isFinished) return;
    const packed = hasAllRows ? null : await coordinator.call('pack', []);
    claimed = claim();
    if (packed) {
      await worker.call('unpack', [packed], { transfer: [packed.buffer as ArrayBuffer] });
    }
    while (claimed) {
      row = claimed.row;
      const rows = await claimed.rows;
      claimed = claim();
      if (rows) {
        await worker.call('setRows', [rows], { transfer: [rows.samples.buffer as ArrayBuffer] });
      }
      for (tile = schedule.takeFromRow(row); tile !== undefined; tile = schedule.takeFromRow(row)) {
        const record = await worker.call('solveTile', [tile]);
        const transfer = [record.buffer as ArrayBuffer];
        await coordinator.call('putTile', [tile, record], { transfer });
        finish(tile);
      }
      schedule.releaseRow(row);
    }
  } catch {
    worker.terminate();
  } finally {
    if (row !== null) schedule.releaseRow(row);
    if (claimed) schedule.releaseRow(claimed.row);
    if (tile !== undefined) schedule.giveBack(tile);
  }
}
