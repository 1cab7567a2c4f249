/** Attributes that are right, and those that are wrong for a while: one of them takes nothing else along. */

import { type PhotoError, toPhotoError } from '../shared/errors.js';

/** See the module. */
export class Attributes {
  readonly #right = new Map<string, unknown>();
  readonly #faults = new Map<string, PhotoError>();
  #untold: PhotoError[] = [];

  /**
   * What `parse` makes of a value; where it throws, of the last one that was right, or of none, for which it
   * does not throw.
   */
  read<T>(name: string, value: string | null, parse: (value: string | null) => T): T {
    try {
      const right = parse(value);
      this.#right.set(name, right);
      this.#faults.delete(name);
      return right;
    } catch (thrown) {
      const fault = toPhotoError(thrown);
      if (this.#faults.get(name)?.message !== fault.message) this.#untold.push(fault);
      this.#faults.set(name, fault);
      return this.#right.has(name) ? (this.#right.get(name) as T) : parse(null);
    }
  }

  /** What is wrong with one that is. */
  get message(): string | null {
    return this.#faults.values().next().value?.message ?? null;
  }

  /** Whether one is wrong. */
  isWrong(name: string): boolean {
    return this.#faults.has(name);
  }

  /** What has gone wrong since this was last asked. */
  takeFaults(): readonly PhotoError[] {
    return this.#untold.splice(0);
  }

  /** Forgets all of it. */
  clear(): void {
    this.#right.clear();
    this.#faults.clear();
    this.#untold = [];
  }
}
