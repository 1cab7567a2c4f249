/** A canvas that a crew of workers draws. */

import type { OutputSettings } from '../../engine/output-settings.js';
import type { CpuModule, DrawnPhoto, Gamut } from '../../engine/types.js';
import { LightCache } from '../../lights/light-cache.js';
import type { LightSetting } from '../../lights/light-setting.js';
import type { Photograph } from '../../photo/photograph.js';
import { hasCode, letGo, messageOf, PhotoError } from '../../shared/errors.js';
import type { CanvasRenderer, FrameResult } from '../types.js';
import type { PoolSession, WorkerPool } from './worker-pool.js';

/** See the module. */
export class WorkerRenderer implements CanvasRenderer {
  readonly canvas: HTMLCanvasElement;
  readonly kernel: string;
  readonly gamut: Gamut;
  readonly #lights: LightCache;
  /** What lights are made for. */
  readonly #plane: DrawnPhoto;
  readonly #photograph: Photograph;
  readonly #pool: WorkerPool;
  readonly #context: CanvasRenderingContext2D;
  #freed = false;

  private constructor(
    module: CpuModule,
    photograph: Photograph,
    pool: WorkerPool,
    context: CanvasRenderingContext2D,
    kernel: string,
    gamut: Gamut,
  ) {
    this.canvas = context.canvas;
    this.kernel = kernel;
    this.gamut = gamut;
    this.#lights = new LightCache(module);
    this.#plane = photograph.plane(module);
    this.#photograph = photograph;
    this.#pool = pool;
    this.#context = context;
  }

  /** Rejects with `worker-unavailable` where there can be no workers; the photograph is whole then. */
  static async create(
    module: CpuModule,
    photograph: Photograph,
    pool: WorkerPool,
    renderOptions: Gamut,
  ): Promise<WorkerRenderer> {
    const canvas = document.createElement('canvas');
    canvas.width = photograph.info.width;
    canvas.height = photograph.info.height;
    // In the page's memory, where the pixels come from: where there is no graphics processor, every
    // frame would go to a program in the place of one and back.
    const context = canvas.getContext('2d', {
      colorSpace: renderOptions,
      willReadFrequently: true,
    });
    if (!context) {
      throw new PhotoError('backend-unavailable', 'The canvas gives no 2D context.');
    }
    const kernel = await photograph.withWorkers(pool, describe);
    // Browsers that know no other gamut say nothing of it.
    const gamut =
      context.getContextAttributes?.().colorSpace === renderOptions ? renderOptions : 'srgb';
    return new WorkerRenderer(module, photograph, pool, context, kernel, gamut);
  }

  async render(
    setting: LightSetting,
    output: OutputSettings,
    detail: number,
  ): Promise<FrameResult> {
    // Before its tiles are brought to the workers for nothing.
    if (this.#freed) throw letGo();
    try {
      return await this.#photograph.withWorkers(this.#pool, async (session) => {
        if (this.#freed) throw letGo();
        const { light, lightApplied, lightError } = this.#lights.get(setting, this.#plane);
        const rows = await session.relight(light, { output, gamut: this.gamut, detail });
        const settings = { colorSpace: this.gamut };
        if (this.#freed) throw letGo();
        // All at once, and before their memory is used again.
        for (const { first, count, pixels } of rows) {
          const data = new Uint8ClampedArray(pixels);
          this.#context.putImageData(
            new ImageData(data, this.canvas.width, count, settings),
            0,
            first,
          );
        }
        return { lightApplied, lightError };
      });
    } catch (thrown) {
      if (!hasCode(thrown, 'worker-unavailable')) throw thrown;
      // Without workers this cannot draw, but a photograph that is fetched anew is drawn by the page.
      throw new PhotoError('photo-lost', messageOf(thrown), thrown);
    }
  }

  free(): void {
    if (this.#freed) return;
    this.#freed = true;
    this.#lights.free();
    this.#plane.free();
  }
}

function describe({ kernel, size }: PoolSession): string {
  return `${kernel}, ${size} ${size === 1 ? 'worker' : 'workers'}`;
}
