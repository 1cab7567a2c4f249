/** Checks what a page passes to `recover`. Names of methods and bases are checked by the module. */

import { PhotoError } from '../shared/errors.js';
import { DEFAULT_WINDOW } from './estimate.js';
import { MAX_CODE, type PreparationSettings } from './protocol.js';
import type {
  FileQuality,
  FolderInput,
  PicturesInput,
  RecoverOptions,
  RecoverySettings,
} from './types.js';

const MAX_WINDOW = 255;
const MIN_GAMMA = 0.1;
const MAX_GAMMA = 10;

/** The settings with their defaults. @throws {PhotoError} `recover-options` */
export function preparationSettings(settings: RecoverySettings): PreparationSettings {
  const { method = 'learned', basis, window = DEFAULT_WINDOW } = settings;
  const isOdd = window === 'auto' || (Number.isInteger(window) && window % 2 === 1);
  const isInRange = window === 'auto' || (window >= 1 && window <= MAX_WINDOW);
  ensure(isOdd && isInRange, 'window', window, `an odd number up to ${MAX_WINDOW}, or "auto"`);
  return { method, basis, window: window === 'auto' ? undefined : window };
}

/** @throws {PhotoError} `recover-options` */
export function checkOptions({ workers = 1, memoryLimit = 1 }: RecoverOptions): void {
  ensure(Number.isInteger(workers) && workers > 0, 'workers', workers, 'a whole number above 0');
  ensure(memoryLimit > 0, 'memoryLimit', memoryLimit, 'a number of bytes above 0');
}

/** @throws {PhotoError} `recover-options` */
export function checkQuality(quality: FileQuality | undefined): void {
  if (quality === undefined || quality === 'lossless') return;
  const { snr, maxBytes } = Object(quality) as { snr?: unknown; maxBytes?: unknown };
  const value = snr ?? maxBytes;
  const isValid = typeof value === 'number' && Number.isFinite(value) && value > 0;
  const allowed = '{ snr } in decibels, { maxBytes }, or "lossless"';
  ensure(isValid, 'quality', JSON.stringify(quality), allowed);
}

/** @throws {PhotoError} `recover-options` */
export function checkInput(input: PicturesInput | FolderInput): void {
  if ('folder' in input) {
    const { shots = 1 } = input;
    ensure(Number.isInteger(shots) && shots > 0, 'shots', shots, 'a whole number above 0');
    return;
  }
  const { patterns, photographs, exposures, correspondence, grayCode } = input;
  const { lightGamma = 1, black = 0, white = MAX_CODE } = input;
  const count = patterns.length;
  ensure(count > 0, 'patterns', 'empty', 'a list of the patterns');
  const each = `a list of ${count}, one for each pattern`;
  ensure(photographs.length === count, 'photographs', `a list of ${photographs.length}`, each);
  if (exposures) {
    ensure(exposures.length === count, 'exposures', `a list of ${exposures.length}`, each);
    for (const exposure of exposures) checkExposure(exposure, 'exposures');
  }
  const ways = [correspondence, grayCode].filter(Boolean).length;
  ensure(
    ways === 1,
    'correspondence',
    ways === 0 ? 'missing' : 'given with grayCode',
    'given, or grayCode',
  );
  const isGamma = lightGamma >= MIN_GAMMA && lightGamma <= MAX_GAMMA;
  ensure(isGamma, 'lightGamma', lightGamma, `between ${MIN_GAMMA} and ${MAX_GAMMA}`);
  ensure(black >= 0 && black < MAX_CODE, 'black', black, 'a 16-bit code');
  ensure(white > black && white <= MAX_CODE, 'white', white, `a 16-bit code above black, ${black}`);
}

/** @throws {PhotoError} `recover-options` */
export function checkExposure(exposure: number, name: string): void {
  ensure(Number.isFinite(exposure) && exposure > 0, name, exposure, 'above 0');
}

function ensure(isValid: boolean, name: string, value: unknown, allowed: string): void {
  if (isValid) return;
  throw new PhotoError('recover-options', `${name} is ${String(value)}; it must be ${allowed}.`);
}
