/** Prepares a recovery in the coordinator and in other workers together. */

import { toPhotoError } from '../shared/errors.js';
import { createGroup, type GroupMembership, portsOf } from './process-group.js';
import type { PreparationSettings, PreparationSummary } from './protocol.js';
import type { RecoveryClient } from './recovery-client.js';

type Client = Pick<RecoveryClient, 'call' | 'terminate'>;

export interface CommonPreparation {
  readonly summary: PreparationSummary;
  /** Whether each of the workers has prepared the same recovery. */
  readonly isPrepared: ReadonlyMap<unknown, Promise<boolean>>;
}

/**
 * `onJob` is called while the coordinator works. If a worker is lost, it and the rest of the group are ended, and the
 * coordinator prepares alone. Rejects if the coordinator fails.
 */
export async function prepareTogether(
  coordinator: Client,
  workers: readonly Client[],
  settings: PreparationSettings,
  onJob: () => void,
): Promise<CommonPreparation> {
  const alone = async (): Promise<CommonPreparation> => {
    const summary = await coordinator.call('prepare', [settings, null], { onProgress: onJob });
    return { summary, isPrepared: new Map() };
  };
  if (workers.length === 0) return alone();
  const packed = await coordinator.call('packInput', []);
  const group = createGroup(workers.length + 1);
  const [own, ...others] = group.members;
  if (!own) return alone();
  const isPrepared = new Map<unknown, Promise<boolean>>();
  for (const [i, worker] of workers.entries()) {
    const member = others[i] as GroupMembership;
    const transfer = portsOf(member);
    const learned = worker.call('learn', [packed, settings, member], { transfer });
    const onFailure = () => {
      group.end();
      return false;
    };
    isPrepared.set(
      worker,
      learned.then(() => true, onFailure),
    );
  }
  try {
    const options = { transfer: portsOf(own), onProgress: onJob };
    const summary = await coordinator.call('prepare', [settings, own], options);
    return { summary, isPrepared };
  } catch (thrown) {
    const isCoordinatorsFault = toPhotoError(thrown).code !== 'worker-unavailable';
    if (isCoordinatorsFault) throw thrown;
    for (const worker of workers) worker.terminate();
    return await alone();
  }
}
