/** The interface that every backend implements: a renderer draws one photograph on one canvas. */

import type { OutputSettings } from '../engine/output-settings.js';
import type { Backend, Freeable, Gamut } from '../engine/wasm-exports.js';
import type { AppliedLightStatus } from '../lights/light-cache.js';
import type { LightSetting } from '../lights/light-setting.js';
import type { LoadedPhotograph } from '../photo/photograph.js';
import type { PixelRect } from '../shared/value-types.js';
import type { QualityController } from './quality-controller.js';

/** Which backends may draw, and in which colours. */
export interface BackendPreferences {
  /** In the order in which they are tried. */
  readonly backends: readonly Backend[];
  /** Whether WebGPU and WebGL2 may be software renderers. */
  readonly software: boolean;
  readonly gamut: Gamut;
}

/** How much of a frame is drawn, and when. */
export interface FramePart {
  /** Pixels out of view may keep an older light. */
  readonly onlyInView?: boolean;
  /** The canvas is whole nevertheless, and only finer parts over it are not. */
  readonly hasOverview?: boolean;
  /** The pixels in view, whole numbers within the picture; all by default. */
  readonly view?: PixelRect;
  /** A renderer that computes in workers shows the frame once this has settled. */
  readonly ready?: (() => Promise<void>) | undefined;
}

export interface Renderer extends Freeable {
  readonly canvas: HTMLCanvasElement;
  /** The implementation, for people: the SIMD level or the graphics adapter. */
  readonly kernel: string;
  /** The gamut that the canvas really has. */
  readonly gamut: Gamut;
  readonly warning?: string;
  /** For this renderer alone: frame times of other renderers say nothing about it. */
  readonly qualityController: QualityController;
  /**
   * Draws one frame with a share of the components (`quality`, 0 to 1). Call it again only after the last promise has
   * settled. If the light is unavailable, the last available one is used and `AppliedLightStatus` has the error. Throws or
   * rejects with `backend-lost`, or with `photo-lost` if parts of the photograph are lost.
   */
  render(
    light: LightSetting,
    output: OutputSettings,
    quality: number,
    part?: FramePart,
  ): AppliedLightStatus | Promise<AppliedLightStatus>;
  /** Lies over the canvas: finer parts of the picture. It fires `LayerChangeEvent`. */
  readonly layer?: HTMLElement;
  /** The picture with its finer parts, for photographs of several levels. Call it directly after `render`. */
  snapshot?(maxSide: number): HTMLCanvasElement;
}

/**
 * Creates a renderer with a canvas of its own, because a canvas cannot change from one graphics API to another. It may
 * stop early once `signal` is aborted. Calls `onLost` at most once. Rejects with `backend-unavailable`, in which case
 * the tiles stay where they are, or with `photo-lost`.
 */
export type CreateRenderer = (
  backend: Backend,
  photo: LoadedPhotograph,
  options: BackendPreferences,
  onLost: (reason: string) => void,
  signal: AbortSignal,
) => Promise<Renderer>;
