/** One recovery: starts the workers, reads, prepares, recovers the tiles, and ends the workers that are not needed. */

import type { hasSimd } from '../engine/wasm-loader.js';
import { PhotoError, toPhotoError } from '../shared/errors.js';
import {
  checkMemory,
  defaultMemoryLimit,
  defaultWorkers,
  encodingSeconds,
  estimateRecovery,
  preparesTogether,
  stageSeconds,
} from './estimate.js';
import { prepareTogether } from './prepare-together.js';
import { ProgressTracker } from './progress-tracker.js';
import type { RecoveryWorker } from './protocol.js';
import { readInput, sizeOfInput } from './read-input.js';
import { recoverTiles } from './recover-tiles.js';
import { CoordinatedPhotograph } from './recovered-photograph.js';
import { RecoveryClient } from './recovery-client.js';
import { checkInput, checkOptions, checkQuality, preparationSettings } from './settings.js';
import type {
  FolderInput,
  PicturesInput,
  RecoveredPhotograph,
  RecoverOptions,
  RecoverySettings,
  RecoverySize,
} from './types.js';

/** Progress of an input whose size is unknown, because it is at fault. */
const UNKNOWN_SIZE: RecoverySize = {
  width: 1,
  height: 1,
  lightWidth: 1,
  lightHeight: 1,
  photographs: 1,
};

export interface RecoveryPorts {
  /** `null` if the page may not have workers. */
  startWorker(): RecoveryWorker | null;
  readonly hasSimd: typeof hasSimd;
}

export async function runRecovery(
  input: PicturesInput | FolderInput,
  settings: RecoverySettings,
  options: RecoverOptions,
  ports: RecoveryPorts,
): Promise<RecoveredPhotograph> {
  const { signal, onProgress, workers = defaultWorkers() } = options;
  const { memoryLimit = defaultMemoryLimit() } = options;
  signal?.throwIfAborted();
  const startMs = performance.now();
  checkOptions(options);
  checkInput(input);
  checkQuality(settings.quality);
  const preparationInput = preparationSettings(settings);
  if (!ports.hasSimd()) throw noSimd();
  const size = await sizeOfInput(input);
  signal?.throwIfAborted();
  if (size) {
    const { memoryBytes } = estimateRecovery(size, settings, { workers, memoryLimit });
    checkMemory(memoryBytes, memoryLimit);
  }
  const clients: RecoveryClient[] = [];
  const end = (): void => {
    for (const client of clients) client.terminate();
  };
  signal?.addEventListener('abort', end);
  try {
    const stages = stageSeconds(size ?? UNKNOWN_SIZE, settings, { workers, memoryLimit });
    const progress = new ProgressTracker(stages, onProgress);
    progress.begin('reading');
    for (let i = 0; i < workers; i += 1) {
      const worker = ports.startWorker();
      if (worker) clients.push(new RecoveryClient(worker));
    }
    const [coordinator, ...tileWorkers] = clients;
    if (!coordinator) throw noWorkers();
    const started: RecoveryClient[] = [];
    for (const worker of tileWorkers) {
      const onStart = () => started.push(worker);
      worker.ready().then(onStart, () => {});
    }
    await coordinator.ready();
    const summary = await readInput(coordinator, input, size, (share) => progress.report(share));
    progress.begin('preparing');
    const onJob = () => progress.report();
    const hasMemory = size && preparesTogether(size, settings, { workers, memoryLimit });
    const group = hasMemory ? started : [];
    const { summary: preparation, isPrepared } = await prepareTogether(
      coordinator,
      // Those that start later recover tiles only.
      [...group],
      preparationInput,
      onJob,
    );
    progress.begin('recovering');
    const helpers = tileWorkers.map((worker) => {
      return { worker, isPrepared: isPrepared.get(worker) ?? Promise.resolve(false) };
    });
    await recoverTiles(coordinator, helpers, preparation, (share) => progress.report(share));
    const finished = await coordinator.call('finish', []);
    signal?.throwIfAborted();
    return new CoordinatedPhotograph(coordinator, {
      input: summary,
      preparation,
      summary: finished,
      seconds: (performance.now() - startMs) / 1000,
      quality: settings.quality,
      encodingSeconds: encodingSeconds(summary),
    });
  } catch (thrown) {
    end();
    signal?.throwIfAborted();
    throw toPhotoError(thrown);
  } finally {
    signal?.removeEventListener('abort', end);
  }
}

function noSimd(): PhotoError {
  const message =
    'This browser or device has no WebAssembly SIMD, without which a recovery would take minutes. Use a current ' +
    'browser, or ltm-export on a computer.';
  return new PhotoError('wasm-simd', message);
}

function noWorkers(): PhotoError {
  const message =
    'Recovery needs workers, and the page may not start them. Serve relightable-photo-recovery.js beside the script, ' +
    'and allow it in worker-src of the content security policy.';
  return new PhotoError('worker-unavailable', message);
}
