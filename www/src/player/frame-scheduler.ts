/**
 * Decides when a frame is drawn: once before the browser's next frame, however often the settings change until then,
 * and again in full quality when a picture of reduced quality is at rest. Changes wait while nobody can see the picture.
 */

import type { FrameClock } from './types.js';

/** A picture is at rest if no new frame is requested for this long after the browser's next frame. */
const REST_DELAY_MS = 150;

export class FrameScheduler {
  #isVisible = true;
  /** Whether a first picture is on the screen. Until then, visibility does not matter. */
  hasPicture = false;
  /** The last frame is out of date. */
  #isStale = false;
  /** The last frame has reduced quality, or only the part in view. */
  #isReduced = false;
  #isFrameRequested = false;
  #cancelRest = (): void => {};

  /** `draw` draws a frame, with the quality that the device has time for unless it is to be full. */
  constructor(
    private readonly ports: FrameClock,
    private readonly draw: (isFullQuality: boolean) => void,
  ) {}

  setVisible(isVisible: boolean): void {
    this.#isVisible = isVisible;
    if (!isVisible) this.#cancelRest();
    else if (this.#isStale) this.invalidate();
    else if (this.#isReduced) this.#awaitRest();
  }

  /** The settings have changed: the picture must be drawn again. */
  invalidate(): void {
    this.#isStale = true;
    this.#cancelRest();
    this.requestFrame();
  }

  /** Checks before the browser's next frame whether the picture is out of date by then. */
  requestFrame(): void {
    if (this.#isFrameRequested || this.#isHidden) return;
    this.#isFrameRequested = true;
    this.ports.nextFrame(() => {
      this.#isFrameRequested = false;
      if (this.#isStale && !this.#isHidden) this.draw(false);
    });
  }

  /** A frame of the current settings is being drawn. */
  frameStarted(): void {
    this.#isStale = false;
    this.#cancelRest();
  }

  frameDrawn(isReduced: boolean): void {
    this.hasPicture = true;
    this.#isReduced = isReduced;
    if (isReduced && !this.#isStale && !this.#isHidden) this.#awaitRest();
  }

  /** The photograph is released; `keepsPicture` if its picture stays on the screen. */
  reset(keepsPicture: boolean): void {
    this.#cancelRest();
    this.#isStale = false;
    this.#isReduced = false;
    this.hasPicture &&= keepsPicture;
  }

  get #isHidden(): boolean {
    return this.hasPicture && !this.#isVisible;
  }

  #awaitRest(): void {
    this.#cancelRest();
    let isCancelled = false;
    this.#cancelRest = () => {
      isCancelled = true;
    };
    // Pages request frames at the rate of the browser's own. If these are slow, the picture still moves.
    this.ports.nextFrame(() => {
      if (isCancelled) return;
      this.#cancelRest = this.ports.callLater(REST_DELAY_MS, () => this.draw(true));
    });
  }
}
