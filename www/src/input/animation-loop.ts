/** Runs named animations in the browser's animation frames, and requests no frame while none runs. */

/** Advances an animation by some seconds; `false` ends it. */
export type AnimationCallback = (seconds: number) => boolean;

/** After a pause, for example in a hidden page, animations continue where they were. */
const MAX_STEP_SECONDS = 0.1;

export class AnimationLoop {
  readonly #steps = new Map<string, AnimationCallback>();
  #isEnabled = true;
  #isRequested = false;
  #lastMs: number | null = null;

  constructor(private readonly requestFrame: (callback: (ms: number) => void) => void) {}

  /** Starts or replaces the animation of that name; `null` ends it. */
  set(name: string, step: AnimationCallback | null): void {
    if (step) this.#steps.set(name, step);
    else this.#steps.delete(name);
    this.#request();
  }

  /** Starts the animation of that name unless it runs, or ends it. */
  toggle(name: string, isRunning: boolean, createStep: () => AnimationCallback): void {
    if (!isRunning) this.set(name, null);
    else if (!this.#steps.has(name)) this.set(name, createStep());
  }

  set isEnabled(isEnabled: boolean) {
    this.#isEnabled = isEnabled;
    this.#request();
  }

  clear(): void {
    this.#steps.clear();
  }

  get #isRunning(): boolean {
    return this.#isEnabled && this.#steps.size > 0;
  }

  #request(): void {
    if (this.#isRequested || !this.#isRunning) return;
    this.#isRequested = true;
    this.requestFrame((ms) => this.#runFrame(ms));
  }

  #runFrame(ms: number): void {
    this.#isRequested = false;
    if (this.#isRunning) {
      const elapsed = (ms - (this.#lastMs ?? ms)) / 1000;
      const seconds = Math.min(MAX_STEP_SECONDS, Math.max(0, elapsed));
      this.#lastMs = ms;
      for (const [name, step] of [...this.#steps]) {
        // A step may replace its own animation.
        if (!step(seconds) && this.#steps.get(name) === step) this.#steps.delete(name);
      }
    }
    if (!this.#isRunning) this.#lastMs = null;
    this.#request();
  }
}
