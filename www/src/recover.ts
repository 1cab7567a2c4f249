/** Recovers relightable photographs in a page, in workers. Importing this module has no side effects. */

import { hasSimd, toModuleFolder } from './engine/wasm-loader.js';
import { startWorker } from './engine/worker-server.js';
import { runRecovery } from './recover/recover.js';
import type {
  FolderInput,
  PicturesInput,
  RecoveredPhotograph,
  RecoverOptions,
  RecoverySettings,
} from './recover/types.js';

export type { PhotographSource, TransferredPhoto } from './photo/types.js';
export { openCaptureFolder } from './recover/capture-folder.js';
export { estimateRecovery } from './recover/estimate.js';
export { sizeOfInput as recoverySize } from './recover/read-input.js';
export type {
  Correspondence,
  EvaluationPair,
  FileQuality,
  FolderInput,
  GrayCodePhotograph,
  LinearPicture,
  PatternInput,
  PhotographFaultCode,
  PhotographInput,
  PicturesInput,
  ProgressOptions,
  RecoveredPhotograph,
  RecoverOptions,
  RecoveryEstimate,
  RecoveryMethod,
  RecoveryProgress,
  RecoverySettings,
  RecoverySize,
  RecoveryStage,
  RecoveryWarning,
  RecoveryWarningCode,
  SparsityBasis,
  TileFunctions,
  TransportFunction,
} from './recover/types.js';
export { type ErrorCode, PhotoError } from './shared/errors.js';

/**
 * Recovers a photograph from patterns and photographs, or from a capture folder. Rejects with a `PhotoError`, or with
 * the signal's reason if it is aborted.
 */
export function recover(
  input: PicturesInput | FolderInput,
  settings: RecoverySettings = {},
  options: RecoverOptions = {},
): Promise<RecoveredPhotograph> {
  const { wasmUrl } = options;
  const folder = wasmUrl === undefined ? undefined : toModuleFolder(wasmUrl);
  return runRecovery(input, settings, options, {
    hasSimd,
    startWorker: () =>
      startWorker(
        () =>
          new Worker(new URL('./relightable-photo-recovery.js', import.meta.url), {
            type: 'module',
          }),
        folder,
      ),
  });
}
