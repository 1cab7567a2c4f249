/** The errors that the package reports. Pages may rely on the codes, but not on the messages. */

import type { ErrorCode } from './error-codes.js';

export type { ErrorCode };

/** An error with a code for programs and a message for people. */
export class PhotoError extends Error {
  readonly code: ErrorCode;

  constructor(code: ErrorCode, message: string, cause?: unknown) {
    super(message, cause === undefined ? undefined : { cause });
    this.name = 'PhotoError';
    this.code = code;
  }
}

export function messageOf(thrown: unknown): string {
  return thrown instanceof Error ? thrown.message : String(thrown);
}

/** Tests the code, not the class: each separately fetched script has a `PhotoError` class of its own. */
export function hasCode(thrown: unknown, code: ErrorCode): boolean {
  return thrown instanceof Error && (thrown as { code?: unknown }).code === code;
}

/** The error of pending work for a photograph that is no longer needed. */
export function photoReleased(): PhotoError {
  return new PhotoError('internal', 'The photograph was released.');
}

/** The codes of failures that the lack of a network may cause. */
const NETWORK_CODE = /^(http-|wasm-|worker-|backend-unavailable|csp-connect)/;

/** The `offline` error in place of a failure to fetch something, if this device is offline. */
export function explainOffline(error: PhotoError): PhotoError {
  if (globalThis.navigator?.onLine !== false || !NETWORK_CODE.test(error.code)) return error;
  const message =
    'This device is offline, so the photograph could not be loaded. It is loaded when the connection returns.';
  return new PhotoError('offline', message, error);
}

/** Anything thrown as a `PhotoError`. Errors without a code become `internal`. */
export function toPhotoError(thrown: unknown): PhotoError {
  if (thrown instanceof PhotoError) return thrown;
  const code = thrown instanceof Error ? (thrown as { code?: unknown }).code : undefined;
  if (typeof code === 'string') {
    const { name, message, cause } = thrown as Error;
    // The `PhotoError` of another script has the original cause.
    return new PhotoError(code, message, name === 'PhotoError' ? cause : thrown);
  }
  return new PhotoError('internal', `An internal error occurred: ${messageOf(thrown)}`, thrown);
}

/** The text with a full stop, unless it ends in one already. */
export function endSentence(text: string): string {
  return /[.!?]$/.test(text) ? text : `${text}.`;
}

/** The sentences that are not empty, as one text. */
export function joinSentences(sentences: readonly (string | undefined)[]): string {
  return sentences.filter(Boolean).join(' ');
}

/** The error for a script that the element fetches on demand; `purpose` completes “The script for …”. */
export function missingScript(code: ErrorCode, purpose: string, cause: unknown): PhotoError {
  const message =
    `The script for ${purpose} could not be loaded (${messageOf(cause)}). Serve it in the same folder as ` +
    "the element's script.";
  return new PhotoError(code, message, cause);
}
