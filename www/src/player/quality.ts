/**
 * By how much of a photograph the frames of a moving picture are drawn, so that they keep up with what
 * moves it. Knows neither a clock nor what draws: it is told when frames began and ended.
 */

/** Shares of the components, all of them first. Half of them take half the time, at best. */
const SHARES = [1, 1 / 2, 1 / 4] as const;
/** 30 frames a second. */
const BUDGET_MS = 1000 / 30;
/** Frames are slow from here on. Those of a display that shows no more than 30 a second are not. */
const SLOW_MS = 1.2 * BUDGET_MS;
/**
 * More is drawn where that can be expected to take no longer. Twice a frame of a display of 60 a second
 * has to be within, as nothing is shown sooner however little there is to do.
 */
const FITS_MS = 1.1 * BUDGET_MS;
/** So many frames are judged at a time, by their median: half of them may be hiccups. */
const JUDGED = 7;
/** What follows later than this is another motion. */
const PAUSE_MS = 100;

// Whatever has to wait is counted in frames of motion, as nothing can be learnt from others.

/** Before more is tried. Doubles where it was tried in vain. */
const PATIENCE = 30;
const MOST_PATIENCE = 64 * PATIENCE;
/** So many times as long where more is not expected to fit: what was in the way may be gone. */
const UNLIKELY = 20;
/** After so many frames, more was not tried in vain. */
const LASTING = 150;
/** Before less is tried again, where that did not help. Doubles each time. */
const RESIGNED = 1000;
const MOST_RESIGNED = 64 * RESIGNED;
/** What less has to save, of the time that it would save if time went by components alone. */
const HELPFUL = 1 / 4;

/** See the module. One for each back end of each photograph, as what one takes says nothing of another. */
export class Quality {
  #step = 0;
  /** How long the last frames took, in this step. */
  #times: number[] = [];
  #ended = Number.NEGATIVE_INFINITY;
  /** Frames that were counted. */
  #frames = 0;
  #changedAt = 0;
  #raisedAt = Number.NEGATIVE_INFINITY;
  #patience = PATIENCE;
  /** What less is to be better than, until it can be told. */
  #dropped: { readonly step: number; readonly ms: number } | null = null;
  #resignedUntil = 0;
  #resigned = RESIGNED;

  /** The share of the components that the next frame of a motion is to be drawn by. */
  get detail(): number {
    return shareOf(this.#step);
  }

  /**
   * A frame of a motion was drawn by that share. `ended` is when the next one could have begun, and not
   * when there was a reason for one.
   */
  drew(began: number, ended: number): void {
    const goesOn = began - this.#ended <= PAUSE_MS;
    this.#ended = ended;
    // Devices that had nothing to do take a while to wake up.
    if (!goesOn) return;
    this.#frames += 1;
    this.#times.push(ended - began);
    if (this.#times.length < JUDGED) return;
    this.#judge(median(this.#times));
    if (this.#times.length === JUDGED) this.#times.shift();
  }

  #judge(ms: number): void {
    const dropped = this.#dropped;
    this.#dropped = null;
    if (dropped && !this.#helps(ms, dropped)) this.#resign();
    else if (ms > SLOW_MS && this.#hasLess) this.#drop(ms);
    else this.#raise(ms);
  }

  get #hasLess(): boolean {
    return this.#step < SHARES.length - 1 && this.#frames >= this.#resignedUntil;
  }

  /** Whether less detail is worth it. It is not where the page itself is slow, or its display. */
  #helps(ms: number, before: { readonly step: number; readonly ms: number }): boolean {
    const hoped = 1 - this.detail / shareOf(before.step);
    return ms <= before.ms * (1 - HELPFUL * hoped);
  }

  /** What is late anyway can as well be sharp. */
  #resign(): void {
    this.#resignedUntil = this.#frames + this.#resigned;
    this.#resigned = Math.min(2 * this.#resigned, MOST_RESIGNED);
    this.#go(0);
  }

  /** To the first step that can be expected to fit. */
  #drop(ms: number): void {
    const inVain = this.#frames - this.#raisedAt < LASTING;
    this.#patience = inVain ? Math.min(2 * this.#patience, MOST_PATIENCE) : PATIENCE;
    this.#dropped = { step: this.#step, ms };
    let step = this.#step + 1;
    while (step < SHARES.length - 1 && this.#expected(ms, step) > BUDGET_MS) step += 1;
    this.#go(step);
  }

  /** Also where the least is late, but seldom: it may not have helped after all. */
  #raise(ms: number): void {
    if (this.#step === 0) return;
    const step = this.#step - 1;
    const fits = this.#expected(ms, step) <= FITS_MS;
    const patience = fits ? this.#patience : UNLIKELY * this.#patience;
    if (this.#frames - this.#changedAt < patience) return;
    this.#raisedAt = this.#frames;
    this.#go(step);
  }

  /** What frames take in another step, if time goes by components alone. */
  #expected(ms: number, step: number): number {
    return (ms * shareOf(step)) / this.detail;
  }

  #go(step: number): void {
    this.#step = step;
    this.#changedAt = this.#frames;
    this.#times = [];
  }
}

function shareOf(step: number): number {
  return SHARES[step] as number;
}

function median(values: readonly number[]): number {
  return [...values].sort((a, b) => a - b)[values.length >> 1] as number;
}
