/** A canvas with a back end on it. */

import type { Backend, Engine, Photo, Relighter } from './engine.js';
import { PhotoError } from './errors.js';
import type { Drawing, LightSetting } from './player.js';

/** What of the module drawing needs. */
type DrawEngine = Pick<Engine, 'Light' | 'Relighter'>;

/** See the module. */
export class CanvasDrawing implements Drawing {
  readonly canvas: HTMLCanvasElement;
  readonly #engine: DrawEngine;
  readonly #photo: Photo;
  readonly #relighter: Relighter;
  readonly #listening = new AbortController();

  private constructor(
    engine: DrawEngine,
    photo: Photo,
    relighter: Relighter,
    canvas: HTMLCanvasElement,
    lost: (reason: string) => void,
  ) {
    this.#engine = engine;
    this.#photo = photo;
    this.#relighter = relighter;
    this.canvas = canvas;
    // Both kinds of GPU may go away while nothing is being drawn.
    const { signal } = this.#listening;
    canvas.addEventListener('webglcontextlost', () => lost('the browser took it away.'), {
      signal,
    });
    void relighter.lost?.then(({ message }) => {
      if (!signal.aborted) lost(message || 'the graphics device is gone.');
    });
  }

  /** Sets a back end up on a canvas of its own: one used by one API cannot be used by another. */
  static async create(
    engine: DrawEngine,
    backend: Backend,
    photo: Photo,
    lost: (reason: string) => void,
  ): Promise<CanvasDrawing> {
    const canvas = document.createElement('canvas');
    const relighter = await engine.Relighter.create(backend, photo, canvas);
    return new CanvasDrawing(engine, photo, relighter, canvas, lost);
  }

  get kernel(): string {
    return this.#relighter.kernel;
  }

  render(setting: LightSetting, exposure: number): void {
    const { Light } = this.#engine;
    const light =
      setting.name === 'torch' && setting.torch
        ? Light.torch(this.#photo, setting.torch.x, setting.torch.y)
        : Light.builtin(this.#photo, setting.name);
    try {
      this.#relighter.render(light, exposure);
    } finally {
      light.free();
    }
  }

  /** The picture as it was drawn last, in the turn of the event loop that drew it. */
  toBlob(type: string, quality?: number): Promise<Blob> {
    return new Promise((resolve, reject) => {
      const done = (blob: Blob | null) =>
        blob
          ? resolve(blob)
          : reject(new PhotoError('internal', `The browser could not encode ${type}.`));
      this.canvas.toBlob(done, type, quality);
    });
  }

  free(): void {
    this.#listening.abort();
    this.#relighter.free();
  }
}
