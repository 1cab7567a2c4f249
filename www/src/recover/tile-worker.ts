/** Recovers tiles in a worker, for the coordinator in another. */

import type { Recovery, RecoveryModule, TileRecovery } from '../engine/recovery-exports.js';
import { ConnectedGroup, type GroupMembership } from './process-group.js';
import type { Answers, PackedRows, PreparationSettings, TileWorkerCalls } from './protocol.js';

export class TileWorker implements Answers<TileWorkerCalls> {
  /** Prepared here. */
  #recovery: Recovery | null = null;
  /** Prepared by the coordinator. */
  #tileRecovery: TileRecovery | null = null;

  /** `report` tells the page the steps of the call in progress. */
  constructor(
    private readonly module: RecoveryModule,
    private readonly report: (steps: number) => void,
  ) {}

  async prepareWith(
    packed: Uint8Array,
    { method, basis, window }: PreparationSettings,
    member: GroupMembership,
  ): Promise<void> {
    const { MeasurementInput, Recovery } = this.module;
    const group = new ConnectedGroup(member, () => this.report(0));
    const input = MeasurementInput.unpack(packed);
    try {
      this.#recovery = await Recovery.prepare(input, method, basis, window, this.report, group);
    } finally {
      input.free();
      group.close();
    }
  }

  unpack(packed: Uint8Array): void {
    this.#tileRecovery = new this.module.TileRecovery(packed);
  }

  setRows({ first, samples }: PackedRows): void {
    this.#tileRecovery?.setRows(first, samples);
  }

  solveTile(tile: number): Uint8Array {
    if (this.#recovery) return this.#recovery.tileRecord(tile);
    if (this.#tileRecovery) return this.#tileRecovery.recoverTile(tile);
    throw new Error('The worker has no recovery.');
  }
}
