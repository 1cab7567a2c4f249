/** Decodes in a worker of its own, which ends with the decoder and so gives its memory back. */

import { PhotoError } from '../shared/errors.js';
import { type WatchdogLimits, WorkerClient, type WorkerLike } from '../shared/worker-client.js';
import { completenessOf, type DecoderState, type PhotoDecoder } from './photo-decoder.js';
import { Photograph } from './photograph.js';
import type { PhotoDescriptor, TileBytes } from './types.js';

export type DecodeTask =
  | { readonly kind: 'feed'; readonly offset: number; readonly bytes: Uint8Array }
  | { readonly kind: 'preview' | 'finish' };

/** A photograph on its way from the worker to the page. */
export interface TransferredPhoto {
  readonly descriptor: PhotoDescriptor;
  readonly tiles: TileBytes[];
}

export type DecodeResult =
  /** Of `feed`. */
  | { readonly state: DecoderState }
  /** Of `preview` and `finish`. */
  | { readonly photo: TransferredPhoto | null }
  /** The file is damaged, or memory is missing. */
  | { readonly error: { readonly code: string; readonly message: string } };

export type DecodeWorker = WorkerLike<DecodeTask, DecoderState, DecodeResult>;

/** A task takes a second at most; a start includes a download and a compilation. */
const LIMITS: WatchdogLimits = { intervalMs: 1000, maxChecks: 30, maxStartChecks: 15 };

export class WorkerDecoder implements PhotoDecoder {
  readonly #client: WorkerClient<DecodeTask, DecoderState, DecodeResult>;
  /** The state after the last task. */
  state: DecoderState;

  private constructor(
    client: WorkerClient<DecodeTask, DecoderState, DecodeResult>,
    state: DecoderState,
  ) {
    this.#client = client;
    this.state = state;
  }

  /** Waits until the worker has started. Rejects with `worker-unavailable` if it does not. */
  static async start(worker: DecodeWorker, limits = LIMITS): Promise<WorkerDecoder> {
    const client = new WorkerClient(worker, {
      name: 'decoding worker',
      limits,
      remedy: 'Load the photograph again.',
    });
    return new WorkerDecoder(client, await client.ready);
  }

  async feed(offset: number, bytes: Uint8Array): Promise<void> {
    const result = await this.#request({ kind: 'feed', offset, bytes });
    if ('state' in result) this.state = result.state;
  }

  preview(): Promise<Photograph | null> {
    return this.#requestPhoto('preview', completenessOf(this.state));
  }

  async finish(): Promise<Photograph> {
    try {
      return (await this.#requestPhoto('finish', 1)) as Photograph;
    } finally {
      this.free();
    }
  }

  free(): void {
    this.#client.terminate();
  }

  /** Resolves to `null` only for a preview. */
  async #requestPhoto(
    kind: 'preview' | 'finish',
    completeness: number,
  ): Promise<Photograph | null> {
    const result = await this.#request({ kind });
    const photo = 'photo' in result ? result.photo : null;
    if (!photo && kind === 'preview') return null;
    if (photo && photo.descriptor.tiles === photo.tiles.length) {
      return new Photograph(photo.descriptor, photo.tiles, completeness);
    }
    throw new PhotoError('internal', 'The decoding worker sent no complete photograph.');
  }

  async #request(task: DecodeTask): Promise<DecodeResult> {
    const result = await this.#client.request(task);
    if ('error' in result) throw new PhotoError(result.error.code, result.error.message);
    return result;
  }
}
