/** What a load of a photograph reports, and how it is cancelled. */

import type { LoadedPhotograph } from './photograph.js';

export interface LoadOptions {
  readonly signal: AbortSignal;
  /** Gets the number of decoded bytes and that of the file, which is 0 until known. */
  readonly onProgress: (loaded: number, total: number) => void;
  /** Gets coarser photographs of the file so far, and must free them; `null` while none are needed. */
  readonly onPreview: ((photograph: LoadedPhotograph) => void) | null;
  /** Called when the load begins to wait for data from the network, and when data has arrived. */
  readonly onWaiting: (isWaiting: boolean) => void;
}
