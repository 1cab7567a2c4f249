/** The visitor's camera: its permission, its fixed settings, and its frames as linear light. */

import { PageFault } from '../page-fault.js';

/** Faults of `getUserMedia` by the names of its errors. @type {Record<string, string>} */
const FAULTS = {
  NotAllowedError: 'camera-refused',
  SecurityError: 'camera-refused',
  NotFoundError: 'camera-missing',
  OverconstrainedError: 'camera-missing',
  NotReadableError: 'camera-busy',
  AbortError: 'camera-busy',
  NotSupportedError: 'camera-unsupported',
};
/** Settings that would follow the light, with the value that each one is fixed at. */
const AUTOMATIC = /** @type {const} */ ({
  exposure: { mode: 'exposureMode', value: 'exposureTime' },
  focus: { mode: 'focusMode', value: 'focusDistance' },
  whiteBalance: { mode: 'whiteBalanceMode', value: 'colorTemperature' },
});
/** Linear values of sRGB codes. The largest stands for all brighter light. */
const LINEAR = Float32Array.from({ length: 256 }, (_, code) => {
  if (code === 255) return Number.NaN;
  const value = code / 255;
  return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
});

/** @typedef {keyof typeof AUTOMATIC} AutomaticSetting */
/** @typedef {Record<string, any>} Settings the compiler does not know all settings of cameras */

export class Camera {
  #video;
  #track;
  #canvas = document.createElement('canvas');
  /** Camera pixels along each side of the square in the middle of the frame. */
  side = 64;

  /** @param {HTMLVideoElement} video @param {MediaStreamTrack} track */
  constructor(video, track) {
    this.#video = video;
    this.#track = track;
  }

  /**
   * Asks for a camera and shows its video.
   *
   * @param {HTMLVideoElement} video
   * @param {string} deviceId of a camera that was chosen before; empty for any
   * @returns {Promise<Camera>}
   */
  static async open(video, deviceId) {
    if (!navigator.mediaDevices || !('requestVideoFrameCallback' in video)) {
      throw new PageFault('camera-unsupported');
    }
    const wanted = {
      width: { ideal: 1280 },
      height: { ideal: 720 },
      ...(deviceId ? { deviceId: { exact: deviceId } } : {}),
    };
    let stream;
    try {
      stream = await navigator.mediaDevices.getUserMedia({ video: wanted });
    } catch (error) {
      const { name } = /** @type {Error} */ (error);
      throw new PageFault(FAULTS[name] ?? 'camera-busy');
    }
    const [track] = stream.getVideoTracks();
    if (!track) throw new PageFault('camera-missing');
    video.srcObject = stream;
    await video.play();
    return new Camera(video, track);
  }

  get isLive() {
    return this.#track.readyState === 'live';
  }

  get deviceId() {
    return this.#track.getSettings().deviceId ?? '';
  }

  /** Calls `listener` when the device vanishes; not after `close`. @param {() => void} listener */
  onEnd(listener) {
    this.#track.addEventListener('ended', listener);
  }

  close() {
    this.#track.stop();
    this.#video.srcObject = null;
  }

  /** Fixes exposure, focus and white balance as they are. @returns {Promise<AutomaticSetting[]>} those that the browser does not let a page fix */
  async lock() {
    const can = this.#capabilities();
    const now = /** @type {Settings} */ (this.#track.getSettings());
    /** @type {AutomaticSetting[]} */
    const unlocked = [];
    for (const name of /** @type {AutomaticSetting[]} */ (Object.keys(AUTOMATIC))) {
      const { mode, value } = AUTOMATIC[name];
      const isPossible = can[mode]?.includes('manual') ?? false;
      const fixed = {
        [mode]: 'manual',
        ...(now[value] === undefined ? {} : { [value]: now[value] }),
      };
      if (!isPossible || !(await this.#apply(fixed))) unlocked.push(name);
    }
    return unlocked;
  }

  /** Halves the exposure, once it is locked. @returns {Promise<boolean>} whether that was possible */
  async darken() {
    const { exposureTime: range } = this.#capabilities();
    // In units of 100 µs.
    const now = /** @type {Settings} */ (this.#track.getSettings())['exposureTime'];
    if (!range || !now || now / 2 < range.min) return false;
    return this.#apply({ exposureMode: 'manual', exposureTime: now / 2 });
  }

  /** The next frame, `[side², 3]`; NaN where it is saturated. @param {AbortSignal} signal @returns {Promise<Float32Array>} */
  next(signal) {
    return new Promise((resolve, reject) => {
      const finish = () => {
        signal.removeEventListener('abort', abort);
        this.#track.removeEventListener('ended', end);
      };
      const abort = () => {
        this.#video.cancelVideoFrameCallback(request);
        finish();
        reject(signal.reason);
      };
      const end = () => {
        finish();
        reject(new PageFault('camera-lost'));
      };
      const request = this.#video.requestVideoFrameCallback(() => {
        finish();
        resolve(this.#read());
      });
      signal.addEventListener('abort', abort);
      this.#track.addEventListener('ended', end);
      if (signal.aborted) abort();
      else if (!this.isLive) end();
    });
  }

  /** Averages blocks of the square in the middle of the frame, as linear light. */
  #read() {
    const { videoWidth: width, videoHeight: height } = this.#video;
    const side = this.side;
    const square = Math.min(width, height);
    const block = Math.max(1, Math.floor(square / side));
    const canvas = this.#canvas;
    if (canvas.width !== block * side) canvas.width = canvas.height = block * side;
    const context = canvas.getContext('2d', { willReadFrequently: true });
    const [left, top] = [(width - square) / 2, (height - square) / 2];
    context?.drawImage(this.#video, left, top, square, square, 0, 0, canvas.width, canvas.height);
    const codes = context?.getImageData(0, 0, canvas.width, canvas.height).data ?? [];
    const frame = new Float32Array(3 * side * side);
    for (let y = 0, i = 0; y < canvas.height; y += 1) {
      const row = 3 * side * Math.floor(y / block);
      for (let x = 0; x < canvas.width; x += 1, i += 4) {
        const pixel = row + 3 * Math.floor(x / block);
        for (let c = 0; c < 3; c += 1) {
          frame[pixel + c] = (frame[pixel + c] ?? 0) + (LINEAR[codes[i + c] ?? 0] ?? 0);
        }
      }
    }
    return frame.map((sum) => sum / block ** 2);
  }

  /** Firefox does not tell them. @returns {Settings} */
  #capabilities() {
    return this.#track.getCapabilities?.() ?? {};
  }

  /** @param {Settings} settings */
  async #apply(settings) {
    try {
      await this.#track.applyConstraints({ advanced: [settings] });
      return true;
    } catch {
      return false;
    }
  }
}
