/** Everything that can go wrong with a photograph, as codes that pages may rely on. */

/** Codes this package's own TypeScript raises. */
export type PageErrorCode =
  /** An attribute has a value the element does not know. */
  | 'attribute'
  /** What `setState` was given has something in it that cannot be. */
  | 'state'
  /** There is no `src`. */
  | 'src-missing'
  /** The server could not be reached, or its answer may not be read from this page. */
  | 'http-network'
  /** The server answered, but not with the file: 404 and the like. */
  | 'http-status'
  /** The server sent a web page in the file's place. */
  | 'http-type'
  /** The transfer ended before the whole file had come. */
  | 'http-short'
  /** Nothing came for a long time. */
  | 'http-stalled'
  /** The file was replaced on the server while it was read. */
  | 'http-changed'
  /** The server sends parts of the file compressed, which are not parts of the file. */
  | 'http-encoding'
  /** The server does not have, or did not send, the part of the file that was asked for. */
  | 'http-range'
  /** The page's content security policy does not let the file be fetched. */
  | 'csp-connect'
  /** The page's content security policy does not let WebAssembly run. */
  | 'csp-wasm'
  /** A WebAssembly module could not be loaded. */
  | 'wasm-unavailable'
  /** The script of the buttons beside the element's could not be loaded. */
  | 'controls-unavailable'
  /** The worker that decodes a photograph stopped at it, for want of memory for one. */
  | 'worker-unavailable'
  /** A worker that had a part of the photograph stopped. The photograph is fetched anew, a few times. */
  | 'photo-lost'
  /** A picture that is to be light shows what this page may not read, from another origin. */
  | 'light-tainted'
  /** What is to be light could not be loaded, played or read. */
  | 'light-source'
  /** Something was asked of a photograph that is not loaded yet. */
  | 'not-loaded'
  /** A fault in this software. */
  | 'internal';

/** Codes the WebAssembly module raises. */
export type EngineErrorCode =
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
export type ErrorCode = PageErrorCode | EngineErrorCode | (string & {});

/** A failure with a code for programs and a message for people. */
export class PhotoError extends Error {
  readonly code: ErrorCode;

  constructor(code: ErrorCode, message: string, cause?: unknown) {
    super(message, cause === undefined ? undefined : { cause });
    this.name = 'PhotoError';
    this.code = code;
  }
}

/** The message of anything thrown. */
export function messageOf(thrown: unknown): string {
  return thrown instanceof Error ? thrown.message : String(thrown);
}

/** Whether that is what went wrong. Each script that is fetched apart has a `PhotoError` of its own. */
export function hasCode(thrown: unknown, code: ErrorCode): boolean {
  return thrown instanceof Error && (thrown as { code?: unknown }).code === code;
}

/** What becomes of what is asked for a photograph that nobody wants any more. */
export function letGo(): PhotoError {
  return new PhotoError('internal', 'The photograph was let go.');
}

/** Anything thrown as a `PhotoError`: those with a code keep it, others are faults of ours. */
export function toPhotoError(thrown: unknown): PhotoError {
  if (thrown instanceof PhotoError) return thrown;
  const code = thrown instanceof Error ? (thrown as { code?: unknown }).code : undefined;
  if (typeof code === 'string') {
    // One of another script's brings its own cause.
    const { name, message, cause } = thrown as Error;
    return new PhotoError(code, message, name === 'PhotoError' ? cause : thrown);
  }
  return new PhotoError('internal', `Something went wrong inside: ${messageOf(thrown)}`, thrown);
}
