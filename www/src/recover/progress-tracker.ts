/** Progress of a call with several stages, and the time that is left. */

import type { RecoveryProgress, RecoveryStage } from './types.js';

/** Expected time of each stage, in seconds, in order. */
export type StageSeconds = readonly (readonly [stage: RecoveryStage, seconds: number])[];

/** In less time than this, nothing can be said of the time that is left. */
const MIN_MEASURED_SECONDS = 0.3;
/** A stage of unknown length counts as nearly done from this share of its expected time on. */
const NEARLY_DONE = 0.8;

export class ProgressTracker {
  #index = 0;
  #startMs: number;
  #lastFraction = 0;
  /** Measured time of the last stage over the expected one. */
  #slowness = 1;

  constructor(
    private readonly stages: StageSeconds,
    private readonly onProgress: ((progress: RecoveryProgress) => void) | undefined,
    private readonly now = () => performance.now(),
  ) {
    this.#startMs = now();
  }

  /** Begins a stage. */
  begin(stage: RecoveryStage): void {
    const [, expected] = this.#current;
    const measured = this.#elapsed;
    this.#index = Math.max(
      0,
      this.stages.findIndex(([name]) => name === stage),
    );
    if (this.#index > 0 && measured > MIN_MEASURED_SECONDS) this.#slowness = measured / expected;
    this.#startMs = this.now();
    this.report(0);
  }

  /** So much of the current stage is done, 0 to 1; by default as much as its time suggests. */
  report(share = this.#shareByTime()): void {
    if (!this.onProgress) return;
    const total = sumSeconds(this.stages);
    const before = sumSeconds(this.stages.slice(0, this.#index));
    const [stage, expected] = this.#current;
    const fraction = Math.min(1, (before + share * expected) / total);
    this.#lastFraction = Math.max(this.#lastFraction, fraction);
    this.onProgress({
      stage,
      fraction: this.#lastFraction,
      secondsLeft: this.#secondsLeft(share),
    });
  }

  #secondsLeft(share: number): number | undefined {
    const elapsed = this.#elapsed;
    const later = this.#slowness * sumSeconds(this.stages.slice(this.#index + 1));
    if (share > 0 && elapsed > MIN_MEASURED_SECONDS) return (elapsed / share) * (1 - share) + later;
    if (this.#index === 0) return undefined;
    return this.#slowness * this.#current[1] * (1 - share) + later;
  }

  /** Never reaches 1. */
  #shareByTime(): number {
    const time = this.#elapsed / (this.#slowness * this.#current[1]);
    if (time <= NEARLY_DONE) return time;
    return 1 - (1 - NEARLY_DONE) * Math.exp((NEARLY_DONE - time) / (1 - NEARLY_DONE));
  }

  get #current(): readonly [RecoveryStage, number] {
    return this.stages[this.#index] as readonly [RecoveryStage, number];
  }

  get #elapsed(): number {
    return (this.now() - this.#startMs) / 1000;
  }
}

/** Expected time of some stages together. */
export function sumSeconds(stages: StageSeconds): number {
  return stages.reduce((sum, [, seconds]) => sum + seconds, 0);
}
