/** Photographs of the visitor's camera, under patterns on a second screen. */

import { recoverCapture } from '../capture-recovery.js';
import { formatNumber, onLanguageChange, t } from '../language.js';
import { PageFault } from '../page-fault.js';
import { saveFile } from '../save-file.js';
import { Camera } from './camera.js';
import { captureFiles } from './capture-files.js';
import { lightPatterns } from './light-patterns.js';
import { PatternWindow } from './pattern-window.js';
import { photographPatterns } from './photograph-patterns.js';
import { zip } from './zip.js';

/** Light elements along each side of the light plane. */
export const LIGHT_SIDE = 32;
export const SEED = 1;
/** Random patterns from which something can be recovered when a fault ends a capture early. */
const MIN_RANDOM_PATTERNS = 20;
const NAME = 'camera';

/**
 * @typedef {import('../types.js').Result} Result
 * @typedef {import('../types.js').ReportStage} ReportStage
 * @typedef {import('./capture-files.js').PatternPhotograph} PatternPhotograph
 * @typedef {import('./photograph-patterns.js').Quality} Quality
 * @typedef {{ signal: AbortSignal, report: ReportStage }} JobOptions
 * @typedef {(work: (options: JobOptions) => Promise<string>) => Promise<void>} RunJob
 */

const byId = (/** @type {string} */ id) => /** @type {HTMLElement} */ (document.getElementById(id));

export class CameraCapture {
  #form = /** @type {HTMLFormElement} */ (byId('camera'));
  #video = /** @type {HTMLVideoElement} */ (byId('camera-preview'));
  #device = /** @type {HTMLSelectElement} */ (byId('camera-device'));
  #status = byId('camera-status');
  #buttons = {
    start: /** @type {HTMLButtonElement} */ (byId('camera-start')),
    window: /** @type {HTMLButtonElement} */ (byId('camera-window')),
    photograph: /** @type {HTMLButtonElement} */ (byId('photograph')),
    save: /** @type {HTMLButtonElement} */ (byId('camera-save')),
  };
  /** @type {Camera | undefined} */
  #camera;
  /** @type {PatternWindow | undefined} */
  #patterns;
  /** @type {ReadonlyMap<string, Blob> | undefined} */
  #files;
  /** @type {() => string[]} */
  #statusTexts = () => [];
  #isPhotographing = false;
  #onChange;

  /** @param {{ run: RunJob, onChange: () => void, onCapture: () => void }} options the job's `run`; `onChange` is called when a capture can be recovered or no longer, `onCapture` after its last photograph */
  constructor({ run, onChange, onCapture }) {
    this.#onChange = onChange;
    this.#form.addEventListener('submit', (event) => event.preventDefault());
    this.#buttons.start.addEventListener('click', () => run(() => this.#start('')));
    this.#device.addEventListener('change', () => run(() => this.#start(this.#device.value)));
    this.#buttons.window.addEventListener('click', () => run(() => this.#openPatterns()));
    this.#buttons.photograph.addEventListener('click', async () => {
      await run((options) => this.#photograph(options));
      if (this.#files) onCapture();
    });
    this.#buttons.save.addEventListener('click', () => run(() => this.#save()));
    document.addEventListener('visibilitychange', () => this.#showStatus());
    onLanguageChange(() => this.#showStatus());
  }

  get hasCapture() {
    return this.#files !== undefined;
  }

  /** Ends camera and pattern window. */
  close() {
    this.#camera?.close();
    this.#camera = undefined;
    this.#patterns?.close();
    this.#patterns = undefined;
    this.#update();
  }

  /** @param {JobOptions} options @returns {Promise<Result>} */
  async recover(options) {
    if (!this.#files) throw new Error('there are no photographs');
    const settings = { method: this.#value('method'), window: this.#value('window') };
    return recoverCapture({ name: NAME, files: this.#files }, settings, options);
  }

  /** @param {string} deviceId */
  async #start(deviceId) {
    this.#camera?.close();
    this.#camera = undefined;
    this.#update();
    const camera = await Camera.open(this.#video, deviceId);
    this.#camera = camera;
    camera.onEnd(() => this.#update());
    await this.#listDevices(camera.deviceId);
    this.#update();
    return t('camera.started');
  }

  /** Lists the cameras, whose names a page may know only after the permission. @param {string} chosen */
  async #listDevices(chosen) {
    const devices = await navigator.mediaDevices.enumerateDevices();
    const cameras = devices.filter(({ kind }) => kind === 'videoinput');
    const options = cameras.map(({ label, deviceId }) => new Option(label, deviceId));
    this.#device.replaceChildren(...options);
    this.#device.value = chosen;
  }

  async #openPatterns() {
    this.#patterns?.close();
    const patterns = await PatternWindow.open(LIGHT_SIDE, t('camera.window.title'));
    this.#patterns = patterns;
    patterns.onClose(() => this.#update());
    patterns.onVisibilityChange(() => this.#showStatus());
    // Full light shows where the object must be, and whether the camera sees it.
    patterns.show(new Uint8Array(LIGHT_SIDE ** 2).fill(255));
    this.#update();
    return t('camera.window.opened');
  }

  /** @param {JobOptions} options */
  async #photograph({ signal, report }) {
    const [camera, screen] = [this.#camera, this.#patterns];
    if (!camera || !screen) throw new Error('camera and pattern window are needed');
    this.#setCapture(undefined);
    camera.side = Number(this.#value('side'));
    const patterns = lightPatterns(LIGHT_SIDE, Number(this.#value('patterns')), SEED);
    const closed = new AbortController();
    screen.onClose(() => closed.abort(new PageFault('patterns-closed')));
    /** @type {PatternPhotograph[]} */
    const photographs = [];
    report('job.photographing', 0);
    this.#isPhotographing = true;
    try {
      const quality = await photographPatterns(
        { camera, screen, patterns },
        {
          signal: AbortSignal.any([signal, closed.signal]),
          onPhotograph: (photograph) => {
            photographs.push(photograph);
            report('job.photographing', photographs.length / patterns.length);
          },
        },
      );
      this.#statusTexts = () => describeQuality(quality);
    } catch (error) {
      // The photographs taken so far are kept.
      const fixed = patterns.filter(({ kind }) => kind !== 'random').length;
      if (!signal.aborted && photographs.length >= fixed + MIN_RANDOM_PATTERNS) {
        await this.#keep(photographs, camera.side);
        const kept = photographs.length - fixed;
        this.#statusTexts = () => [t('camera.kept', { patterns: kept })];
      }
      throw error;
    } finally {
      this.#isPhotographing = false;
      this.#showStatus();
    }
    await this.#keep(photographs, camera.side);
    return t('camera.done', { photographs: photographs.length });
  }

  /** @param {PatternPhotograph[]} photographs @param {number} side */
  async #keep(photographs, side) {
    const capture = { side, lightSide: LIGHT_SIDE, title: t('camera.title') };
    this.#setCapture(await captureFiles(photographs, capture));
  }

  /** @param {ReadonlyMap<string, Blob> | undefined} files */
  #setCapture(files) {
    this.#files = files;
    this.#update();
  }

  async #save() {
    const file = await zip(this.#files ?? new Map());
    saveFile(file, `${NAME}.zip`);
    return t('done.file', { size: formatNumber(file.size / 1e6, 2) });
  }

  #update() {
    const isLive = this.#camera?.isLive ?? false;
    byId('camera-view').hidden = !isLive;
    this.#buttons.photograph.disabled = !isLive || !this.#patterns?.isOpen;
    this.#buttons.save.hidden = this.#files === undefined;
    this.#showStatus();
    this.#onChange();
  }

  #showStatus() {
    const isPaused = this.#isPhotographing && (document.hidden || this.#patterns?.isHidden);
    const texts = isPaused ? [t('camera.paused')] : this.#statusTexts();
    this.#status.textContent = texts.join(' ');
  }

  /** @param {string} name */
  #value(name) {
    return /** @type {HTMLSelectElement} */ (this.#form.elements.namedItem(name)).value;
  }
}

/** What the photographs are worth. @param {Quality} quality */
function describeQuality({ noise, frames, unlocked }) {
  const settings = unlocked.map((name) => t(`camera.${name}`)).join(', ');
  return [
    t('camera.noise', { noise: formatNumber(100 * noise, 2), frames }),
    ...(settings ? [t('camera.unlocked', { settings })] : []),
  ];
}
