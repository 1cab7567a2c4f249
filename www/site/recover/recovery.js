/** The recovery of `relightable-photo/recover`, which is loaded with the first recovery. */

/**
 * @typedef {typeof import('../../src/recover.js')} RecoverModule
 * @typedef {import('../../src/recover/types.js').RecoverySettings} RecoverySettings
 * @typedef {import('../../src/recover/types.js').PicturesInput} PicturesInput
 * @typedef {import('../../src/recover/types.js').FolderInput} FolderInput
 * @typedef {import('./types.js').MethodSettings} MethodSettings
 * @typedef {import('./types.js').ReportStage} ReportStage
 */

/** @type {Promise<RecoverModule> | undefined} */
let loading;

/** @returns {Promise<RecoverModule>} */
export function recoverModule() {
  loading ??= import(new URL('../../relightable-photo/recover.js', import.meta.url).href);
  return loading;
}

/** @param {MethodSettings} settings @returns {RecoverySettings} */
export function recoverSettings({ method, window }) {
  const [name, basis] = method.split(' ');
  return /** @type {RecoverySettings} */ ({
    method: name,
    ...(basis ? { basis } : {}),
    window: window === 'auto' ? 'auto' : Number(window),
  });
}

/**
 * Recovers and reports the stages.
 *
 * @param {PicturesInput | FolderInput} input
 * @param {MethodSettings} settings
 * @param {{ signal: AbortSignal, report: ReportStage }} options
 */
export async function recoverWith(input, settings, { signal, report }) {
  const { recover } = await recoverModule();
  return recover(input, recoverSettings(settings), {
    signal,
    onProgress: ({ stage, fraction, secondsLeft }) => report(`job.${stage}`, fraction, secondsLeft),
  });
}
