/** Decodes in workers. One that has finished decodes the next photograph, unless it is idle or its memory has grown. */

import { PhotoError } from '../shared/errors.js';
import { callLater } from '../shared/promises.js';
import { type WatchdogLimits, WorkerClient, type WorkerLike } from '../shared/worker-client.js';
import { completenessOf, type DecoderProgress, type PhotoDecoder } from './photo-decoder.js';
import { LoadedPhotograph } from './photograph.js';
import type { TransferredPhoto } from './types.js';

export type DecodeTask =
  | { readonly kind: 'feed'; readonly offset: number; readonly bytes: Uint8Array }
  /** Starts a file. */
  | { readonly kind: 'open'; readonly maxTileBytes: number | undefined }
  | { readonly kind: 'preview' | 'finish' };

export type DecodeResult =
  /** Of `open` and `feed`. */
  | { readonly state: DecoderProgress }
  /** Of `preview` and `finish`; `memoryBytes` is the size of the module's memory, which does not shrink. */
  | { readonly photo: TransferredPhoto | null; readonly memoryBytes: number }
  /** The file is damaged, or memory is missing. */
  | { readonly error: { readonly code: string; readonly message: string } };

export type DecodeWorker = WorkerLike<DecodeTask, null, DecodeResult>;
type DecodeClient = WorkerClient<DecodeTask, null, DecodeResult>;

/** A task takes a second at most on an idle machine; a start includes a download and a compilation. */
const LIMITS: WatchdogLimits = { intervalMs: 1000, maxChecks: 30, maxStartChecks: 60 };
/** An idle worker ends after this time. */
const MAX_IDLE_MS = 1000;
/** A worker with more memory ends with its photograph. */
const MAX_MEMORY_BYTES = 128 << 20;

export class DecodeWorkers {
  #idle: DecodeClient | null = null;
  #cancelEnd = (): void => {};

  /** `start` gives `null` if the page may not start workers. */
  constructor(
    private readonly start: () => DecodeWorker | null,
    private readonly limits = LIMITS,
    private readonly maxIdleMs = MAX_IDLE_MS,
  ) {}

  /** Gives a decoder once its worker has started; `null` if the page may have none. Rejects with `worker-unavailable`. */
  async createDecoder(maxTileBytes?: number): Promise<PhotoDecoder | null> {
    const client = this.#takeIdle() ?? this.#startClient();
    if (!client) return null;
    await client.ready;
    const keep = (memoryBytes: number) => this.#keep(client, memoryBytes);
    return await openDecoder(client, maxTileBytes, keep);
  }

  #takeIdle(): DecodeClient | null {
    this.#cancelEnd();
    const client = this.#idle;
    this.#idle = null;
    return client?.failure ? null : client;
  }

  #startClient(): DecodeClient | null {
    const worker = this.start();
    const options = { name: 'decoding worker', remedy: 'Load the photograph again.' };
    return worker && new WorkerClient(worker, { ...options, limits: this.limits });
  }

  #keep(client: DecodeClient, memoryBytes: number): void {
    if (this.#idle || memoryBytes > MAX_MEMORY_BYTES) {
      client.terminate();
      return;
    }
    this.#idle = client;
    this.#cancelEnd = callLater(this.maxIdleMs, () => this.#takeIdle()?.terminate());
  }
}

/** `onFinished` gets the worker back; after a failure, and if it is freed early, the worker ends instead. */
async function openDecoder(
  client: DecodeClient,
  maxTileBytes: number | undefined,
  onFinished: (memoryBytes: number) => void,
): Promise<PhotoDecoder> {
  let hasEnded = false;
  const free = () => {
    if (!hasEnded) client.terminate();
    hasEnded = true;
  };
  const request = async (task: DecodeTask): Promise<DecodeResult> => {
    if (hasEnded) throw new PhotoError('internal', 'The decoder was freed.');
    try {
      const result = await client.request(task);
      if ('error' in result) throw new PhotoError(result.error.code, result.error.message);
      return result;
    } catch (thrown) {
      // After an error, the state of its module is unknown.
      free();
      throw thrown;
    }
  };
  /** The state after the last task. */
  let state: DecoderProgress = {
    bytesFed: 0,
    fileBytes: undefined,
    bytesOfLevels: undefined,
    scansDone: 0,
    next: undefined,
  };
  const requestState = async (task: DecodeTask): Promise<void> => {
    const result = await request(task);
    if ('state' in result) state = result.state;
  };
  const requestPhoto = async (kind: 'preview' | 'finish', completeness: number) => {
    const result = await request({ kind });
    const { photo, memoryBytes } =
      'photo' in result ? result : { photo: null, memoryBytes: Number.POSITIVE_INFINITY };
    if (!photo && kind === 'preview') return null;
    if (photo && photo.descriptor.tiles === photo.tiles.length) {
      const photograph = new LoadedPhotograph(photo.descriptor, photo.tiles, completeness);
      if (kind === 'finish') {
        hasEnded = true;
        onFinished(memoryBytes);
      }
      return photograph;
    }
    throw new PhotoError('internal', 'The decoding worker sent no complete photograph.');
  };
  await requestState({ kind: 'open', maxTileBytes });
  return {
    get state() {
      return state;
    },
    feed: (offset, bytes) => requestState({ kind: 'feed', offset, bytes }),
    preview: () => requestPhoto('preview', completenessOf(state)),
    async finish() {
      try {
        return (await requestPhoto('finish', 1)) as LoadedPhotograph;
      } finally {
        free();
      }
    },
    free,
  };
}
