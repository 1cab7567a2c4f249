/** What the modules of the page share. */

import type { RecoveredPhotograph } from '../../src/recover/types.js';
import type { SimulationWorker } from './simulation.js';

/** A simulated scene, in a worker of its own. */
export interface Truth {
  readonly worker: SimulationWorker;
  /** The same for scenes with the same transport. */
  readonly key: string;
  /** Side of the window that holds the band, in light elements. */
  readonly window: number;
}

/** A recovery that the page shows, with the true transport if it is known. */
export interface Result {
  readonly recovered: RecoveredPhotograph;
  readonly truth: Truth | undefined;
  /** Name of the file to save, without its ending. */
  readonly name: string;
  /** What the page says about it, in the page's language. */
  facts(): string[];
}

/** Reports a stage of a job, by the key of its text, and its share, 0 to 1. */
export type ReportStage = (key: string, share: number, secondsLeft?: number) => void;

/** Values of a select for method and basis. */
export interface MethodSettings {
  readonly method: string;
  readonly window: string;
}
