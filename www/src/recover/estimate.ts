/** What a recovery takes: memory of all workers, and time. Measured, see `docs/recover.md`. */

import { PhotoError } from '../shared/errors.js';
import { type StageSeconds, sumSeconds } from './progress-tracker.js';
import type { PictureSize } from './protocol.js';
import type { RecoverOptions, RecoveryEstimate, RecoverySettings, RecoverySize } from './types.js';

export const DEFAULT_WINDOW = 15;
/** The widest window that `auto` tries. */
const MAX_AUTO_WINDOW = 31;
const MAX_DEFAULT_WORKERS = 4;
/** Camera pixels along a side of a recovered tile, and around it. */
const TILE_SIDE = 32;
const HALO = 10;
/** Most camera pixels whose samples are resampled while a recovery is prepared, if the camera trembled. */
const MAX_RESAMPLED_PIXELS = 132_096;
const PIXEL_BYTES = 12;
/** Of the preparation, what every worker of a group does. */
const UNDIVIDED_SHARE = 0.25;

const MAX_DEFAULT_MEMORY_BYTES = 2 ** 30;
/** Share of the device's memory. */
const MEMORY_SHARE = 1 / 4;

/** `deviceMemory` is in GiB, up to 8, and known in some browsers. */
type DeviceNavigator = { readonly deviceMemory?: number; readonly hardwareConcurrency?: number };

export function defaultWorkers(): number {
  const { hardwareConcurrency = 1 } = (globalThis.navigator ?? {}) as DeviceNavigator;
  return Math.max(1, Math.min(MAX_DEFAULT_WORKERS, hardwareConcurrency));
}

export function defaultMemoryLimit(): number {
  const { deviceMemory = 8 } = (globalThis.navigator ?? {}) as DeviceNavigator;
  return Math.min(MAX_DEFAULT_MEMORY_BYTES, MEMORY_SHARE * deviceMemory * 2 ** 30);
}

/** What a recovery of this size takes, before it starts. */
export function estimateRecovery(
  size: RecoverySize,
  settings: RecoverySettings = {},
  options: Pick<RecoverOptions, 'workers' | 'memoryLimit'> = {},
): RecoveryEstimate {
  const seconds = sumSeconds(stageSeconds(size, settings, options));
  const { alone, together } = memoryBytes(size, settings, options);
  const memory = preparesTogether(size, settings, options) ? together : alone;
  return { memoryBytes: Math.round(memory), seconds };
}

/** Whether there is memory for all workers to have all measurements, and prepare the recovery together. */
export function preparesTogether(
  size: RecoverySize,
  settings: RecoverySettings,
  options: Pick<RecoverOptions, 'workers' | 'memoryLimit'>,
): boolean {
  const { memoryLimit = defaultMemoryLimit() } = options;
  return memoryBytes(size, settings, options).together <= memoryLimit;
}

function windowArea({ window = DEFAULT_WINDOW }: RecoverySettings): number {
  return (window === 'auto' ? MAX_AUTO_WINDOW : window) ** 2;
}

/** Bytes of all workers, if only the coordinator has all measurements and if all have. */
function memoryBytes(
  { width, height, lightWidth, lightHeight, photographs }: RecoverySize,
  settings: RecoverySettings,
  { workers = defaultWorkers() }: Pick<RecoverOptions, 'workers'>,
): { readonly alone: number; readonly together: number } {
  const area = windowArea(settings);
  const pixels = width * height;
  const tile = Math.min(pixels, TILE_SIDE ** 2);
  const rows = Math.min(height, TILE_SIDE + 2 * HALO) * width;
  // The module, the models of learned recovery, and a tile's equations.
  const each = 24 * 2 ** 20 + 8 * area * area * 16 + 2 * PIXEL_BYTES * tile * area;
  const patterns = PIXEL_BYTES * photographs * lightWidth * lightHeight;
  const measurements = PIXEL_BYTES * photographs * pixels + patterns;
  const resampled = PIXEL_BYTES * photographs * Math.min(pixels, MAX_RESAMPLED_PIXELS);
  const all = workers * each + measurements + 8 * pixels * area;
  const strips = 2 * PIXEL_BYTES * photographs * rows + patterns;
  // Measurements are packed before they are sent, and each worker has the packed ones for a while: in its memory, and as
  // JavaScript's array. Those of the coordinator grow by doubling.
  const packed = 3 * measurements + 3 * (workers - 1) * measurements;
  // Nothing is resampled before everything is sent.
  const shared = Math.max(packed, workers * resampled);
  return {
    alone: all + resampled + (workers - 1) * strips,
    together: all + (workers > 1 ? shared : resampled),
  };
}

/** Expected time of each stage of `recover`. */
export function stageSeconds(
  size: RecoverySize,
  settings: RecoverySettings,
  options: Pick<RecoverOptions, 'workers' | 'memoryLimit'>,
): StageSeconds {
  const { width, height, photographs } = size;
  const { workers = defaultWorkers() } = options;
  const area = windowArea(settings);
  const pixels = width * height;
  const samples = pixels * photographs;
  const { method = 'learned' } = settings;
  const perPixel = { learned: 2e-4, nnls: 3e-4, bpdn: 3e-3 }[method] * (area / 225);
  const alone = (method === 'learned' ? 4 : 1.5) * (area / 225) + 2e-8 * samples;
  const together = UNDIVIDED_SHARE + (1 - UNDIVIDED_SHARE) / workers;
  const preparing = alone * (preparesTogether(size, settings, options) ? together : 1);
  return [
    ['reading', 0.1 + 1e-7 * samples],
    ['preparing', preparing],
    ['recovering', 0.1 + (perPixel * pixels) / workers],
  ];
}

/** Expected time of `toBlob`. */
export function encodingSeconds({ width, height }: PictureSize): number {
  return 0.3 + 5e-5 * width * height;
}

/** @throws {PhotoError} `recover-memory` if the recovery takes more than the limit */
export function checkMemory(memoryBytes: number, limit: number): void {
  if (memoryBytes <= limit) return;
  const [needed, allowed] = [memoryBytes, limit].map((bytes) => Math.ceil(bytes / 2 ** 20));
  const message =
    `This recovery takes about ${needed} MiB of memory, but the limit is ${allowed} MiB. Recover with fewer camera ` +
    'pixels, photographs or workers, or raise memoryLimit.';
  throw new PhotoError('recover-memory', message);
}
