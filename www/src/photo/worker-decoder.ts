/** Decodes in a worker of its own, which ends with the decoder and so gives its memory back. */

import { PhotoError } from '../shared/errors.js';
import { type WatchdogLimits, WorkerClient, type WorkerLike } from '../shared/worker-client.js';
import { completenessOf, type DecoderProgress, type PhotoDecoder } from './photo-decoder.js';
import { LoadedPhotograph } from './photograph.js';
import type { PhotoDescriptor, TransferredTile } from './types.js';

export type DecodeTask =
  | { readonly kind: 'feed'; readonly offset: number; readonly bytes: Uint8Array }
  | { readonly kind: 'preview' | 'finish' };

/** A photograph on its way from the worker to the page. */
export interface TransferredPhoto {
  readonly descriptor: PhotoDescriptor;
  readonly tiles: TransferredTile[];
}

export type DecodeResult =
  /** Of `feed`. */
  | { readonly state: DecoderProgress }
  /** Of `preview` and `finish`. */
  | { readonly photo: TransferredPhoto | null }
  /** The file is damaged, or memory is missing. */
  | { readonly error: { readonly code: string; readonly message: string } };

export type DecodeWorker = WorkerLike<DecodeTask, DecoderProgress, DecodeResult>;

/** A task takes a second at most; a start includes a download and a compilation. */
const LIMITS: WatchdogLimits = { intervalMs: 1000, maxChecks: 30, maxStartChecks: 15 };

/** Waits until the worker has started. Rejects with `worker-unavailable` if it does not. */
export async function startWorkerDecoder(worker: DecodeWorker, limits = LIMITS) {
  const options = { name: 'decoding worker', limits, remedy: 'Load the photograph again.' };
  const client = new WorkerClient<DecodeTask, DecoderProgress, DecodeResult>(worker, options);
  /** The state after the last task. */
  let state = await client.ready;

  const request = async (task: DecodeTask): Promise<DecodeResult> => {
    const result = await client.request(task);
    if ('error' in result) throw new PhotoError(result.error.code, result.error.message);
    return result;
  };
  const requestPhoto = async (kind: 'preview' | 'finish', completeness: number) => {
    const result = await request({ kind });
    const photo = 'photo' in result ? result.photo : null;
    if (!photo && kind === 'preview') return null;
    if (photo && photo.descriptor.tiles === photo.tiles.length) {
      return new LoadedPhotograph(photo.descriptor, photo.tiles, completeness);
    }
    throw new PhotoError('internal', 'The decoding worker sent no complete photograph.');
  };
  return {
    get state() {
      return state;
    },
    async feed(offset: number, bytes: Uint8Array) {
      const result = await request({ kind: 'feed', offset, bytes });
      if ('state' in result) state = result.state;
    },
    preview: () => requestPhoto('preview', completenessOf(state)),
    async finish() {
      try {
        return (await requestPhoto('finish', 1)) as LoadedPhotograph;
      } finally {
        client.terminate();
      }
    },
    free: () => client.terminate(),
  } satisfies PhotoDecoder;
}
