/** What goes on from frame to frame: fire, the breathing light, what glides after a drag. Knows no clock. */

/** Does what is due after so many seconds; `false` once it is at its end. */
export type Step = (seconds: number) => boolean;

/** After a pause, as of a page that was not shown, things go on where they were. */
const MOST_SECONDS = 0.1;

/** See the module. */
export class Frames {
  readonly #nextFrame: (callback: (ms: number) => void) => void;
  readonly #steps = new Map<string, Step>();
  #allowed = true;
  #asked = false;
  #last: number | null = null;

  /** `nextFrame` gives milliseconds since any moment. */
  constructor(nextFrame: (callback: (ms: number) => void) => void) {
    this.#nextFrame = nextFrame;
  }

  /** Begins what has that name, or puts it in the place of what had it; `null` ends it. */
  set(name: string, step: Step | null): void {
    if (step) this.#steps.set(name, step);
    else this.#steps.delete(name);
    this.#ask();
  }

  /** As `set`, where it is not under way already. */
  keep(name: string, step: Step): void {
    if (!this.#steps.has(name)) this.set(name, step);
  }

  has(name: string): boolean {
    return this.#steps.has(name);
  }

  /** Whether anyone looks. While nobody does, all of it stands still. */
  allow(allowed: boolean): void {
    this.#allowed = allowed;
    this.#ask();
  }

  clear(): void {
    this.#steps.clear();
  }

  get #runs(): boolean {
    return this.#allowed && this.#steps.size > 0;
  }

  #ask(): void {
    if (this.#asked || !this.#runs) return;
    this.#asked = true;
    this.#nextFrame((ms) => {
      this.#asked = false;
      if (!this.#runs) {
        this.#last = null;
        return;
      }
      const seconds = Math.min(MOST_SECONDS, Math.max(0, (ms - (this.#last ?? ms)) / 1000));
      this.#last = ms;
      for (const [name, step] of [...this.#steps]) {
        // It may have been replaced by another in its own step.
        if (!step(seconds) && this.#steps.get(name) === step) this.#steps.delete(name);
      }
      if (!this.#runs) this.#last = null;
      this.#ask();
    });
  }
}
