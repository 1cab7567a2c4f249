/** Recovery of a capture folder: one that the visitor chose, or that the camera has just made. */

import { formatNumber, t } from './language.js';
import { recoverWith } from './recovery.js';

/**
 * @typedef {import('./types.js').Result} Result
 * @typedef {import('./types.js').MethodSettings} MethodSettings
 * @typedef {import('./types.js').ReportStage} ReportStage
 * @typedef {{ name: string, files: ReadonlyMap<string, Blob> }} Capture
 */

/**
 * @param {Capture} capture
 * @param {MethodSettings} settings
 * @param {{ signal: AbortSignal, report: ReportStage }} options
 * @returns {Promise<Result>}
 */
export async function recoverCapture({ name, files }, settings, options) {
  const recovered = await recoverWith({ folder: files }, settings, options);
  const heldOut = await recovered.evaluateHeldOut();
  return {
    recovered,
    truth: undefined,
    name: name.replace(/\.zip$/i, '') || 'capture',
    facts: () => [
      t('fact.patterns', { patterns: recovered.shotsUsed.length }),
      ...(heldOut === undefined ? [] : [t('fact.heldOut', { snr: formatNumber(heldOut, 1) })]),
    ],
  };
}
