/**
 * Chooses the quality of an animation's frames, so that they keep a rate of 30 a second. It learns only from the begin
 * and end of such frames, and has no clock: every delay is a number of frames.
 */

const FRAME_BUDGET_MS = 1000 / 30;
/** Longer frames are slow. Above the budget, because a display of 30 Hz shows no frame sooner. */
const SLOW_FRAME_MS = 1.2 * FRAME_BUDGET_MS;
/** Quality rises if frames are expected to take at most this long, in which two frames of a 60 Hz display must fit. */
const MAX_EXPECTED_MS = 1.1 * FRAME_BUDGET_MS;
/** Frames per decision, which uses their median: up to half of them may be outliers. */
const WINDOW_FRAMES = 7;
/** A frame that begins later than this after the last one belongs to another animation. */
const MAX_GAP_MS = 100;

/** Frames before a higher quality is tried; doubles after each failure. */
const RAISE_DELAY_FRAMES = 30;
const MAX_RAISE_DELAY_FRAMES = 64 * RAISE_DELAY_FRAMES;
/** Factor on that delay if the higher quality is not expected to fit; what slowed it may be over. */
const UNLIKELY_RAISE_FACTOR = 20;
/** A raise that lasts this many frames was no failure. */
const MIN_LASTING_FRAMES = 150;
/** Frames before a lower quality is tried again after it did not help; doubles each time. */
const DROP_DELAY_FRAMES = 1000;
const MAX_DROP_DELAY_FRAMES = 64 * DROP_DELAY_FRAMES;
/** The least that a lower quality must save, relative to a saving in proportion to the components. */
const MIN_SAVING = 1 / 4;

/** The quality and the median frame time before the quality was lowered. */
interface QualityBeforeDrop {
  readonly quality: number;
  readonly ms: number;
}

export class QualityController {
  /** The share of the components for the next frame of an animation. */
  quality = 1;
  /** Of the last frames in this quality. */
  #durations: number[] = [];
  #lastEndMs = Number.NEGATIVE_INFINITY;
  #frames = 0;
  #changedAtFrame = 0;
  #raisedAtFrame = Number.NEGATIVE_INFINITY;
  #raiseDelay = RAISE_DELAY_FRAMES;
  /** The last drop, until its effect is known. */
  #drop: QualityBeforeDrop | null = null;
  #noDropBeforeFrame = 0;
  #dropDelay = DROP_DELAY_FRAMES;
  readonly #minQuality: number;

  /** Quality has three values, with this factor between them; at best, it is that of the frames' durations too. */
  constructor(private readonly factor = 2) {
    this.#minQuality = factor ** -2;
  }

  /** Records a frame of an animation. `endMs` is when the next frame could have begun, whether or not one was due. */
  recordFrame(startMs: number, endMs: number): void {
    const isContinued = startMs - this.#lastEndMs <= MAX_GAP_MS;
    this.#lastEndMs = endMs;
    // The first frame of an animation includes the device's wake-up.
    if (!isContinued) return;
    this.#frames += 1;
    this.#durations.push(endMs - startMs);
    if (this.#durations.length < WINDOW_FRAMES) return;
    this.#decide(median(this.#durations));
    if (this.#durations.length === WINDOW_FRAMES) this.#durations.shift();
  }

  /** The last frames did not have their quality yet: they say nothing about it. */
  discardFrames(): void {
    this.#durations = [];
  }

  #decide(ms: number): void {
    const drop = this.#drop;
    this.#drop = null;
    if (drop && !this.#hasHelped(drop, ms)) this.#undoDrop();
    else if (ms > SLOW_FRAME_MS && this.#canLower) this.#lower(ms);
    else this.#raiseIfDue(ms);
  }

  get #canLower(): boolean {
    return this.quality > this.#minQuality && this.#frames >= this.#noDropBeforeFrame;
  }

  /** A lower quality does not help if the page itself is slow, or its display. */
  #hasHelped(drop: QualityBeforeDrop, ms: number): boolean {
    const idealSaving = 1 - this.quality / drop.quality;
    return ms <= drop.ms * (1 - MIN_SAVING * idealSaving);
  }

  /** If frames are slow anyway, they can as well have full quality. */
  #undoDrop(): void {
    this.#noDropBeforeFrame = this.#frames + this.#dropDelay;
    this.#dropDelay = Math.min(2 * this.#dropDelay, MAX_DROP_DELAY_FRAMES);
    this.#setQuality(1);
  }

  /** Goes to the highest quality that is expected to fit. */
  #lower(ms: number): void {
    const isFailedRaise = this.#frames - this.#raisedAtFrame < MIN_LASTING_FRAMES;
    this.#raiseDelay = isFailedRaise
      ? Math.min(2 * this.#raiseDelay, MAX_RAISE_DELAY_FRAMES)
      : RAISE_DELAY_FRAMES;
    this.#drop = { quality: this.quality, ms };
    let quality = this.quality / this.factor;
    const isSlow = () => this.#expectedMs(ms, quality) > FRAME_BUDGET_MS;
    while (quality > this.#minQuality && isSlow()) quality /= this.factor;
    this.#setQuality(quality);
  }

  /** Rarely, it also tries a quality that is not expected to fit. */
  #raiseIfDue(ms: number): void {
    if (this.quality === 1) return;
    const quality = this.factor * this.quality;
    const isLikely = this.#expectedMs(ms, quality) <= MAX_EXPECTED_MS;
    const delay = isLikely ? this.#raiseDelay : UNLIKELY_RAISE_FACTOR * this.#raiseDelay;
    if (this.#frames - this.#changedAtFrame < delay) return;
    this.#raisedAtFrame = this.#frames;
    this.#setQuality(quality);
  }

  /** The duration in another quality, if it is proportional to the number of components. */
  #expectedMs(ms: number, quality: number): number {
    return (ms * quality) / this.quality;
  }

  #setQuality(quality: number): void {
    this.quality = quality;
    this.#changedAtFrame = this.#frames;
    this.#durations = [];
  }
}

function median(values: readonly number[]): number {
  return [...values].sort((a, b) => a - b)[values.length >> 1] as number;
}
