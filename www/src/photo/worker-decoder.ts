/** Decodes in a worker of its own, which ends with the decoder and so gives its memory back. */

import { PhotoError } from '../shared/errors.js';
import type { WatchdogLimits } from '../shared/watchdog.js';
import { WorkerClient, type WorkerLike } from '../shared/worker-client.js';
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
  #state: DecoderState = { bytesFed: 0, fileBytes: undefined, scansDone: 0, next: undefined };

  private constructor(worker: DecodeWorker, limits: WatchdogLimits) {
    this.#client = new WorkerClient(worker, {
      name: 'decoding worker',
      limits,
      remedy: 'Load the photograph again.',
    });
  }

  /** Waits until the worker has started. Rejects with `worker-unavailable` if it does not. */
  static async start(worker: DecodeWorker, limits = LIMITS): Promise<WorkerDecoder> {
    const decoder = new WorkerDecoder(worker, limits);
    decoder.#state = await decoder.#client.ready;
    return decoder;
  }

  get state(): DecoderState {
    return this.#state;
  }

  async feed(offset: number, bytes: Uint8Array): Promise<void> {
    const result = await this.#request({ kind: 'feed', offset, bytes });
    if ('state' in result) this.#state = result.state;
  }

  preview(): Promise<Photograph | null> {
    return this.#requestPhoto('preview', completenessOf(this.#state));
  }

  async finish(): Promise<Photograph> {
    try {
      const photograph = await this.#requestPhoto('finish', 1);
      if (photograph) return photograph;
      throw incomplete();
    } finally {
      this.free();
    }
  }

  free(): void {
    this.#client.terminate();
  }

  async #requestPhoto(
    kind: 'preview' | 'finish',
    completeness: number,
  ): Promise<Photograph | null> {
    const result = await this.#request({ kind });
    if (!('photo' in result) || !result.photo) return null;
    const { descriptor, tiles } = result.photo;
    if (descriptor.tiles === tiles.length) {
      return Photograph.fromTiles(descriptor, tiles, completeness);
    }
    throw incomplete();
  }

  async #request(task: DecodeTask): Promise<DecodeResult> {
    const result = await this.#client.request(task);
    if ('error' in result) throw new PhotoError(result.error.code, result.error.message);
    return result;
  }
}

function incomplete(): PhotoError {
  return new PhotoError('internal', 'The decoding worker sent no complete photograph.');
}
