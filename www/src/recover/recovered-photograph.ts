/** The result of a recovery. The coordinator keeps the photograph and answers. */

import type { TransferredPhoto } from '../photo/types.js';
import { PhotoError, toPhotoError } from '../shared/errors.js';
import { withTimeout } from '../shared/promises.js';
import { ProgressTracker } from './progress-tracker.js';
import type {
  CoordinatorCalls,
  InputSummary,
  PictureError,
  PreparationSummary,
  RecoverySummary,
} from './protocol.js';
import type { CallOptions, RecoveryClient } from './recovery-client.js';
import { toSentPicture } from './send-pictures.js';
import { checkExposure, checkQuality } from './settings.js';
import type {
  Correspondence,
  EvaluationPair,
  FileQuality,
  ProgressOptions,
  RecoveredPhotograph,
  RecoveryWarning,
  TileFunctions,
  TransportFunction,
} from './types.js';
import { describeWarnings } from './warnings.js';

/** What the coordinator said of a finished recovery. */
export interface FinishedRecovery {
  readonly input: InputSummary;
  readonly preparation: PreparationSummary;
  readonly summary: RecoverySummary;
  readonly seconds: number;
  /** Of files, by default. */
  readonly quality: FileQuality | undefined;
  /** Expected time of encoding. */
  readonly encodingSeconds: number;
}

export class CoordinatedPhotograph implements RecoveredPhotograph {
  readonly width: number;
  readonly height: number;
  readonly lightWidth: number;
  readonly lightHeight: number;
  readonly window: number;
  readonly rank: number | undefined;
  readonly expectedSnr: number | undefined;
  readonly correspondence: Correspondence;
  readonly shotsUsed: readonly number[];
  readonly warnings: readonly RecoveryWarning[];
  readonly seconds: number;
  readonly #coordinator: Pick<RecoveryClient, 'call' | 'terminate'>;
  readonly #recovery: FinishedRecovery;
  #isFreed = false;

  constructor(coordinator: Pick<RecoveryClient, 'call' | 'terminate'>, recovery: FinishedRecovery) {
    const { input, preparation, summary } = recovery;
    this.#coordinator = coordinator;
    this.#recovery = recovery;
    this.width = input.width;
    this.height = input.height;
    this.lightWidth = summary.lightWidth;
    this.lightHeight = summary.lightHeight;
    this.window = preparation.window;
    this.rank = preparation.rank;
    this.expectedSnr = preparation.expectedSnr;
    this.correspondence = input.correspondence;
    this.shotsUsed = input.shotsUsed;
    this.warnings = describeWarnings(input, preparation, summary);
    this.seconds = recovery.seconds;
  }

  async load({ signal }: { readonly signal: AbortSignal }): Promise<TransferredPhoto> {
    signal.throwIfAborted();
    return await withTimeout(this.#call('photo', []), { signal });
  }

  async toBlob(
    quality: FileQuality | undefined = this.#recovery.quality,
    { signal, onProgress }: ProgressOptions = {},
  ): Promise<Blob> {
    signal?.throwIfAborted();
    checkQuality(quality);
    const stages = [['encoding', this.#recovery.encodingSeconds]] as const;
    const progress = new ProgressTracker(stages, onProgress);
    progress.begin('encoding');
    const encoded = this.#call('encode', [quality], { onProgress: () => progress.report() });
    const bytes = await withTimeout(encoded, signal ? { signal } : {});
    return new Blob([bytes]);
  }

  async evaluate(pairs: readonly EvaluationPair[]): Promise<number | undefined> {
    const total = { signal: 0, error: 0 };
    for (const [i, { light, photograph, exposure = 1 }] of pairs.entries()) {
      checkExposure(exposure, `pairs[${i}].exposure`);
      const [sentLight, sentPhotograph] = await Promise.all([
        toSentPicture(light, `pairs[${i}].light`),
        toSentPicture(photograph, `pairs[${i}].photograph`),
      ]);
      const pair = await this.#call('evaluatePair', [i, sentLight, sentPhotograph, exposure]);
      total.signal += pair.signal;
      total.error += pair.error;
    }
    return toDecibels(total);
  }

  async evaluateHeldOut(): Promise<number | undefined> {
    return toDecibels(await this.#call('evaluateHeldOut', []));
  }

  relight(light: Float32Array): Promise<Float32Array> {
    return this.#call('relight', [light]);
  }

  transportFunction(x: number, y: number): Promise<TransportFunction> {
    return this.#call('transportFunction', [x, y]);
  }

  pointScatteringFunction(u: number, v: number): Promise<Float32Array> {
    return this.#call('pointScatteringFunction', [u, v]);
  }

  tileFunctions(index: number): Promise<TileFunctions | undefined> {
    return this.#call('tileFunctions', [index]);
  }

  free(): void {
    this.#isFreed = true;
    this.#coordinator.terminate();
  }

  async #call<M extends keyof CoordinatorCalls>(
    method: M,
    args: Parameters<CoordinatorCalls[M]>,
    options?: CallOptions,
  ): Promise<ReturnType<CoordinatorCalls[M]>> {
    try {
      if (!this.#isFreed) return await this.#coordinator.call(method, args, options);
    } catch (thrown) {
      if (!this.#isFreed) throw toPhotoError(thrown);
    }
    throw new PhotoError('internal', 'The recovered photograph was freed.');
  }
}

function toDecibels({ signal, error }: PictureError): number | undefined {
  return signal > 0 ? 10 * Math.log10(signal / error) : undefined;
}
