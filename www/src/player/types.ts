/** The interfaces of a photo session: its settings, its ports to the browser, and its listener. */

import type { OutputSettings } from '../engine/output-settings.js';
import type { Backend } from '../engine/wasm-exports.js';
import type { AppliedLightStatus } from '../lights/light-cache.js';
import type { LightSetting } from '../lights/light-setting.js';
import type { LoadOptions } from '../photo/load-options.js';
import type { Placement } from '../photo/load-queue.js';
import type { PhotoLibrary } from '../photo/photo-library.js';
import type { PhotographSource } from '../photo/types.js';
import type { BackendPreferences, CreateRenderer, Renderer } from '../renderers/types.js';
import type { PhotoError } from '../shared/errors.js';
import type { callLater } from '../shared/promises.js';

/** Everything that the element's attributes and the visitor decide. */
export interface SessionSettings {
  /** Absolute address, or what stands for a file; `null` if there is neither. */
  readonly src: string | PhotographSource | null;
  readonly credentials: RequestCredentials;
  readonly backendOptions: BackendPreferences;
  readonly light: LightSetting;
  readonly output: OutputSettings;
}

export interface FrameClock {
  nextFrame(callback: () => void): void;
  readonly callLater: typeof callLater;
  /** Milliseconds, from any start. */
  now(): number;
}

/** Loading and drawing; tests replace them. */
export interface SessionPorts extends FrameClock {
  readonly library: Pick<PhotoLibrary, 'open' | 'update'>;
  /** Warms up the backend that will probably be used, until `signal` is aborted. */
  prepare(options: BackendPreferences, signal: AbortSignal): void;
  readonly createRenderer: CreateRenderer;
  /** Copies the picture of a graphics device, which loses it, to a canvas that keeps it. */
  copyCanvas(renderer: Pick<Renderer, 'canvas' | 'gamut'>): HTMLCanvasElement;
}

export interface PhotoSessionListener {
  /** Where the element is now. */
  readonly placement: Placement;
  /** A load starts; the last photograph is gone. */
  loadStarted(): void;
  progress: LoadOptions['onProgress'];
  /** A new renderer has drawn its first frame: its canvas replaces the last one. */
  rendererChanged(renderer: Pick<Renderer, 'canvas' | 'layer'>): void;
  /** A frame was drawn; `light` is the light that was requested for it. */
  frameDrawn(frame: AppliedLightStatus, light: LightSetting): void;
  /** That frame has another quality than the last one. The first frame is compared with 1. */
  qualityChanged(quality: number): void;
  /** The whole photograph was drawn for the first time since it was fetched. */
  loaded(): void;
  /** Another backend is in use, or the same one again after a loss. */
  backendChanged(backend: Backend, previous: Backend | null, reason: string): void;
  backendLost(backend: Backend, reason: string): void;
  /** There is no picture. */
  failed(error: PhotoError): void;
  /** The last picture stays on the screen. */
  warned(error: PhotoError): void;
  /** A frame was drawn after `failed` or `warned`. */
  recovered(): void;
}
