/** Recovers tiles in a worker, for the coordinator in another. */

import type { RecoveryModule, TileRecovery } from '../engine/recovery-exports.js';
import type { PackedRows, TileWorkerCalls } from './protocol.js';

export class TileWorker implements TileWorkerCalls {
  #recovery: TileRecovery | null = null;

  constructor(private readonly module: RecoveryModule) {}

  unpack(packed: Uint8Array): void {
    this.#recovery = new this.module.TileRecovery(packed);
  }

  setRows({ first, samples }: PackedRows): void {
    this.#recovery?.setRows(first, samples);
  }

  solveTile(tile: number): Uint8Array {
    if (!this.#recovery) throw new Error('The worker has no recovery.');
    return this.#recovery.recoverTile(tile);
  }
}
