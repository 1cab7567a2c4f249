/** Draws with the CPU in the page's worker pool; the page copies the pixels to the canvas. */

import type { OutputSettings } from '../../engine/output-settings.js';
import type { CpuModule, Gamut, ReceivedPhoto } from '../../engine/types.js';
import { LightCache } from '../../lights/light-cache.js';
import type { LightSetting } from '../../lights/light-setting.js';
import type { Photograph } from '../../photo/photograph.js';
import { hasCode, messageOf, PhotoError, photoReleased } from '../../shared/errors.js';
import { encodePicture } from '../canvas-export.js';
import { QualityController } from '../quality-controller.js';
import type { CanvasRenderer, FrameResult } from '../types.js';
import type { RowPixels } from './pool-session.js';
import type { WorkerPool } from './worker-pool.js';

export class WorkerRenderer implements CanvasRenderer {
  readonly encode = encodePicture;
  readonly quality = new QualityController();
  readonly canvas: HTMLCanvasElement;
  readonly #lights: LightCache;
  /** The photograph without tiles. */
  readonly #lightPlane: ReceivedPhoto;
  readonly #photograph: Photograph;
  readonly #pool: WorkerPool;
  readonly #context: CanvasRenderingContext2D;
  #isFreed = false;

  private constructor(
    module: CpuModule,
    readonly kernel: string,
    readonly gamut: Gamut,
    photograph: Photograph,
    pool: WorkerPool,
    context: CanvasRenderingContext2D,
  ) {
    this.canvas = context.canvas;
    this.#photograph = photograph;
    this.#pool = pool;
    this.#context = context;
    this.#lights = new LightCache(module);
    this.#lightPlane = photograph.createLightPlane(module);
  }

  /** Rejects with `worker-unavailable` if there are no workers; the photograph is unchanged then. */
  static async create(
    module: CpuModule,
    photograph: Photograph,
    pool: WorkerPool,
    requestedGamut: Gamut,
  ): Promise<WorkerRenderer> {
    const canvas = document.createElement('canvas');
    canvas.width = photograph.info.width;
    canvas.height = photograph.info.height;
    // Keeps the canvas in the page's memory: a software renderer would copy every frame twice.
    const context = canvas.getContext('2d', {
      colorSpace: requestedGamut,
      willReadFrequently: true,
    });
    if (!context) {
      throw new PhotoError('backend-unavailable', 'The browser has no canvas with a 2D context.');
    }
    const kernel = await photograph.withWorkers(pool, ({ kernel, size }) => {
      return `${kernel}, ${size} ${size === 1 ? 'worker' : 'workers'}`;
    });
    // A browser without support for the gamut ignores it.
    const { colorSpace } = context.getContextAttributes?.() ?? {};
    const gamut = colorSpace === requestedGamut ? requestedGamut : 'srgb';
    return new WorkerRenderer(module, kernel, gamut, photograph, pool, context);
  }

  async render(
    setting: LightSetting,
    output: OutputSettings,
    quality: number,
  ): Promise<FrameResult> {
    this.#checkNotFreed();
    try {
      return await this.#photograph.withWorkers(this.#pool, async (session) => {
        this.#checkNotFreed();
        const { light, ...result } = this.#lights.get(setting, this.#lightPlane);
        const rows = await session.relight(light, { output, gamut: this.gamut, quality });
        this.#checkNotFreed();
        // All rows in one task, before the next frame reuses their memory.
        for (const part of rows) this.#copyToCanvas(part);
        return result;
      });
    } catch (thrown) {
      if (!hasCode(thrown, 'worker-unavailable')) throw thrown;
      // Once the photograph is fetched again, it is drawn on the page's thread.
      throw new PhotoError('photo-lost', messageOf(thrown), thrown);
    }
  }

  free(): void {
    if (this.#isFreed) return;
    this.#isFreed = true;
    this.#lights.free();
    this.#lightPlane.free();
  }

  #checkNotFreed(): void {
    if (this.#isFreed) throw photoReleased();
  }

  #copyToCanvas({ firstRow, rows, pixels }: RowPixels): void {
    const data = new Uint8ClampedArray(pixels);
    const image = new ImageData(data, this.canvas.width, rows, { colorSpace: this.gamut });
    this.#context.putImageData(image, 0, firstRow);
  }
}
