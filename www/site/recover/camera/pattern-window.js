/** A window on the second screen that shows patterns. */

import { PageFault } from '../page-fault.js';

/** Size of the window before the visitor makes it full screen. */
const SIZE_PX = 560;

/** @typedef {{ left: number, top: number, width: number, height: number }} ScreenPlace */

export class PatternWindow {
  #window;
  #canvas;
  #side;
  /** `closed` of the window is set only after its event. */
  #isClosed = false;
  /** @type {Uint8Array | undefined} */
  #codes;

  /** @param {Window} opened @param {number} side of the light plane, in elements @param {string} title */
  constructor(opened, side, title) {
    this.#window = opened;
    this.#side = side;
    const { document } = opened;
    document.title = title;
    // The content security policy forbids inline styles, but not those that scripts set.
    Object.assign(document.body.style, {
      margin: '0',
      height: '100vh',
      display: 'grid',
      placeItems: 'center',
      overflow: 'hidden',
      background: '#000',
      cursor: 'none',
    });
    this.#canvas = document.createElement('canvas');
    this.#canvas.width = this.#canvas.height = side;
    this.#canvas.style.imageRendering = 'pixelated';
    document.body.replaceChildren(this.#canvas);
    // Full screen needs a click in this window.
    document.body.addEventListener('click', () => {
      document.documentElement.requestFullscreen().catch(() => {});
    });
    opened.addEventListener('pagehide', () => {
      this.#isClosed = true;
    });
    opened.addEventListener('resize', () => this.#fit());
    this.#fit();
  }

  /**
   * Opens the window, on the second screen where the browser tells its place. Call this while a click is handled.
   *
   * @param {number} side of the light plane, in elements
   * @param {string} title
   */
  static async open(side, title) {
    const place = await secondScreen();
    const { left, top, width, height } = place ?? {
      left: 0,
      top: 0,
      width: SIZE_PX,
      height: SIZE_PX,
    };
    const features = `popup,left=${left},top=${top},width=${width},height=${height}`;
    const opened = window.open('', 'patterns', features);
    if (!opened) throw new PageFault('patterns-blocked');
    return new PatternWindow(opened, side, title);
  }

  get isOpen() {
    return !this.#isClosed && !this.#window.closed;
  }

  get isHidden() {
    return this.isOpen && this.#window.document.hidden;
  }

  close() {
    this.#window.close();
  }

  /** Calls `listener` when the window is hidden or seen again. @param {() => void} listener */
  onVisibilityChange(listener) {
    this.#window.document.addEventListener('visibilitychange', listener);
  }

  /** Calls `listener` when the window is closed. @param {() => void} listener */
  onClose(listener) {
    this.#window.addEventListener('pagehide', listener);
  }

  /** Shows a pattern. @param {Uint8Array} codes */
  show(codes) {
    if (!this.isOpen) throw new PageFault('patterns-closed');
    this.#codes = codes;
    const image = new ImageData(this.#side, this.#side);
    for (const [m, code] of codes.entries()) image.data.set([code, code, code, 255], 4 * m);
    this.#canvas.getContext('2d')?.putImageData(image, 0, 0);
  }

  /** Makes the canvas as large as fits; all light elements get the same number of the screen's pixels. */
  #fit() {
    const { innerWidth, innerHeight, devicePixelRatio } = this.#window;
    const fits = Math.min(innerWidth, innerHeight) * devicePixelRatio;
    const pixels = this.#side * Math.max(1, Math.floor(fits / this.#side));
    this.#canvas.style.width = this.#canvas.style.height = `${pixels / devicePixelRatio}px`;
    if (this.#codes) this.show(this.#codes);
  }
}

/** The place of another screen, if the browser has the Window Management API and the visitor allows it. @returns {Promise<ScreenPlace | undefined>} */
async function secondScreen() {
  if (!('getScreenDetails' in window)) return undefined;
  try {
    const manager = /** @type {{ getScreenDetails(): Promise<any> }} */ (
      /** @type {unknown} */ (window)
    );
    const { screens, currentScreen } = await manager.getScreenDetails();
    const other = screens.find((/** @type {unknown} */ screen) => screen !== currentScreen);
    if (!other) return undefined;
    const { availLeft: left, availTop: top, availWidth: width, availHeight: height } = other;
    return { left, top, width, height };
  } catch {
    return undefined;
  }
}
