/** Prepares a recovery in the coordinator and in other workers together. */

import { toPhotoError } from '../shared/errors.js';
import { createGroup, type GroupMembership, portsOf } from './process-group.js';
import type { PreparationSettings, PreparationSummary } from './protocol.js';
import type { RecoveryClient } from './recovery-client.js';

type Client = Pick<RecoveryClient, 'call'>;

/** Codes of a worker's own faults. All workers find the faults of the input. */
const WORKERS_FAULTS: readonly string[] = ['worker-unavailable', 'recover-memory', 'internal'];

export interface CommonPreparation {
  readonly summary: PreparationSummary;
  /** Whether each of the workers has prepared the same recovery. */
  readonly isPrepared: ReadonlyMap<unknown, Promise<boolean>>;
}

/**
 * `onJob` is called while the coordinator works. If another worker is lost, the coordinator prepares again alone. Rejects if
 * the coordinator fails.
 */
export async function prepareTogether(
  coordinator: Client,
  workers: readonly Client[],
  settings: PreparationSettings,
  onJob: () => void,
): Promise<CommonPreparation> {
  const isPrepared = new Map<unknown, Promise<boolean>>();
  const prepare = async (
    member: GroupMembership | null,
    transfer: MessagePort[],
  ): Promise<CommonPreparation> => {
    const options = { transfer, onProgress: onJob };
    return { summary: await coordinator.call('prepare', [settings, member], options), isPrepared };
  };
  if (workers.length === 0) return prepare(null, []);
  const packed = await coordinator.call('packInput', []);
  const group = createGroup(workers.length + 1);
  const [own, ...others] = group.members as [GroupMembership, ...GroupMembership[]];
  for (const [i, member] of others.entries()) {
    const worker = workers[i] as Client;
    const options = { transfer: portsOf(member) };
    const prepared = worker.call('prepareWith', [packed, settings, member], options).then(
      () => true,
      (thrown: unknown) => {
        // The coordinator finds faults of the input as well.
        if (WORKERS_FAULTS.includes(toPhotoError(thrown).code)) group.end();
        return false;
      },
    );
    isPrepared.set(worker, prepared);
  }
  void Promise.all(isPrepared.values()).then(() => group.close());
  try {
    return await prepare(own, portsOf(own));
  } catch (thrown) {
    if (toPhotoError(thrown).code !== 'worker-unavailable') throw thrown;
    return await prepare(null, []);
  }
}
