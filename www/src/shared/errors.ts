/** The errors that the package reports. Pages may rely on the codes, but not on the messages. */

/** Codes of the package's TypeScript, which the site's page about troubleshooting explains. */
export type PageErrorCode =
  | 'attribute' // An attribute has an unknown or invalid value.
  | 'state' // The text passed to `setState` has an invalid value.
  | 'src-missing' // `src` is not set.
  | 'http-network' // The server cannot be reached, or this page may not read its response.
  | 'http-status' // The server answered with an error status, such as 404.
  | 'http-type' // The server sent a web page instead of the file.
  | 'http-short' // The transfer ended before the end of the file.
  | 'http-stalled' // No data arrived for 30 seconds.
  | 'http-changed' // The file on the server was replaced during the transfer.
  | 'http-encoding' // The server compresses partial responses, which makes them unreadable.
  | 'http-range' // The server refused a range of the file, or sent another one.
  | 'csp-connect' // The page's content security policy blocks the request for the file.
  | 'csp-wasm' // The page's content security policy blocks WebAssembly.
  | 'wasm-unavailable' // A WebAssembly module could not be loaded.
  | 'controls-unavailable' // The toolbar's script could not be loaded.
  | 'input-unavailable' // The script for gestures, keys and animations could not be loaded.
  | 'worker-unavailable' // The worker that decodes the photograph stopped, usually because memory ran out.
  | 'photo-lost' // A worker with a part of the photograph stopped. The photograph is fetched again, up to five times.
  | 'light-tainted' // The light image contains data of another origin, which this page may not read.
  | 'light-source' // The light image could not be loaded, played or read.
  | 'not-loaded' // A method was called before the photograph was loaded.
  | 'internal'; // A bug in this package.

/** Codes of the WebAssembly modules. */
export type WasmErrorCode =
  | 'format-magic'
  | 'format-text-mode'
  | 'format-version'
  | 'format-checksum'
  | 'format-invalid'
  | 'format-limit'
  | 'format-truncated'
  | 'light-name'
  | 'light-size'
  | 'light-value'
  | 'backend-unavailable'
  | 'backend-lost';

/** Any code; a newer WebAssembly module may add some. */
export type ErrorCode = PageErrorCode | WasmErrorCode | (string & {});

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
