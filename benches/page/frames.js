/** Runs in the page. Shows an element on one backend and measures its frame times. */

import { devices, drawCount, drawn, waitForScreen } from './hooks.js';

/** @typedef {import('../../www/src/index.js').RelightablePhotoElement} RelightablePhotoElement */
/** @typedef {'video' | 'torch' | 'exposure' | 'canvas'} KindName */

/** Number of different lights that the frames alternate between. */
const LIGHTS = 4;
const FEWEST = 3;
/** Factor on a part's duration after which even too few frames are enough. */
const LONGEST = 5;
const MOST = 200;
/** After slower frames the element would lower the quality, unless it rests between them. */
const SLOW_MS = 30;
const REST_MS = 120;
const CANVAS = { width: 640, height: 360 };
/** Width of the element on the page, in CSS pixels. */
const SHOWN = '256px';

/**
 * Adds an element to the page. Resolves when it shows its photograph, rejects with its error.
 *
 * @param {string} src
 * @param {string | null} backend
 * @returns {Promise<RelightablePhotoElement>}
 */
export async function mount(src, backend) {
  await customElements.whenDefined('relightable-photo');
  const photo = document.createElement('relightable-photo');
  photo.style.width = SHOWN;
  if (backend) photo.backend = backend;
  photo.src = src;
  const loaded = new Promise((resolve, reject) => {
    photo.addEventListener('load', resolve);
    photo.addEventListener('error', ({ code, message }) =>
      reject(new Error(`${code}: ${message}`)),
    );
  });
  document.body.append(photo);
  await loaded;
  return photo;
}

/** A number from 0 to 1. */
const noise = () => Math.random();

/** @type {Record<KindName, (photo: RelightablePhotoElement) => (frame: number) => void>} */
const KINDS = {
  /** Changes every light element, in colour, in each frame. */
  video(photo) {
    const { lightWidth: width, lightHeight: height } = /** @type {any} */ (photo.info);
    const films = Array.from({ length: LIGHTS }, () =>
      Float32Array.from({ length: 3 * width * height }, noise),
    );
    const source = { data: films[0], width, height };
    photo.light = /** @type {any} */ (source);
    return (frame) => {
      source.data = films[frame % LIGHTS];
      photo.lightChanged();
    };
  },
  /** Draws another image to a source canvas in each frame. */
  canvas(photo) {
    const films = Array.from({ length: LIGHTS }, () => {
      const film = new OffscreenCanvas(CANVAS.width, CANVAS.height);
      const pixels = new ImageData(CANVAS.width, CANVAS.height);
      pixels.data.forEach((_, i) => {
        pixels.data[i] = i % 4 === 3 ? 255 : 256 * noise();
      });
      film.getContext('2d')?.putImageData(pixels, 0, 0);
      return film.transferToImageBitmap();
    });
    const canvas = Object.assign(document.createElement('canvas'), CANVAS);
    const context = canvas.getContext('2d');
    photo.light = canvas;
    return (frame) => {
      context?.drawImage(/** @type {ImageBitmap} */ (films[frame % LIGHTS]), 0, 0);
      photo.lightChanged();
    };
  },
  torch(photo) {
    photo.light = 'torch';
    return (frame) => {
      photo.torch = { x: 0.3 + 0.04 * (frame % LIGHTS), y: 0.5 };
    };
  },
  /** Changes the exposure under the last light of the kinds above. */
  exposure(photo) {
    return (frame) => {
      photo.exposure = 1 + 0.1 * (frame % LIGHTS);
    };
  },
};

/**
 * Waits until the picture is complete. A WebGPU device reports that. For other canvases, another canvas reads one
 * pixel: browsers move a 2D canvas out of graphics memory when the page reads the canvas itself.
 *
 * @param {RelightablePhotoElement} photo
 */
async function finished(photo) {
  if (photo.activeBackend === 'webgpu') {
    await Promise.all([...devices].map((device) => device.queue.onSubmittedWorkDone()));
    return;
  }
  readPixel(canvasOf(photo));
}

/** @param {RelightablePhotoElement} photo */
const canvasOf = (photo) =>
  /** @type {HTMLCanvasElement} */ (photo.shadowRoot?.querySelector('canvas'));

const probe = document.createElement('canvas').getContext('2d', { willReadFrequently: true });

/** @param {HTMLCanvasElement} canvas */
function readPixel(canvas) {
  probe?.drawImage(canvas, 0, 0, 1, 1, 0, 0, 1, 1);
  probe?.getImageData(0, 0, 1, 1);
}

/**
 * Draws frames of a kind one after the other for some seconds. Returns milliseconds from each change until the element
 * has drawn (`issued`) and until the picture is complete (`done`).
 *
 * @param {RelightablePhotoElement} photo
 * @param {KindName} name
 * @param {number} seconds
 */
export async function time(photo, name, seconds) {
  const change = KINDS[name](photo);
  waitForScreen(false);
  await frame(photo, change, 1);
  await settled();
  const times = { issued: /** @type {number[]} */ ([]), done: /** @type {number[]} */ ([]) };
  const start = performance.now();
  for (let i = 0; i < MOST; i += 1) {
    const passed = (performance.now() - start) / 1000;
    if (i >= FEWEST ? passed > seconds : passed > LONGEST * seconds) break;
    // Each frame differs from the one before, the first included.
    const { issued, done } = await frame(photo, change, i + 2);
    if (photo.quality !== 1)
      throw new Error(`a frame was drawn by ${photo.quality} of the components`);
    times.issued.push(issued);
    times.done.push(done);
    if (done > SLOW_MS) await new Promise((resolve) => setTimeout(resolve, REST_MS));
  }
  waitForScreen(true);
  return times;
}

/** Waits until the element draws no more: a new light source and its first change can be two pictures. */
async function settled() {
  let before = -1;
  while (before !== drawCount()) {
    before = drawCount();
    await new Promise((resolve) => setTimeout(resolve, REST_MS));
  }
}

/**
 * @param {RelightablePhotoElement} photo
 * @param {(frame: number) => void} change
 * @param {number} i
 */
async function frame(photo, change, i) {
  const drawing = drawn();
  const start = performance.now();
  change(i);
  await drawing;
  const issued = performance.now() - start;
  await finished(photo);
  return { issued, done: performance.now() - start };
}

/**
 * Draws `count` frames without waiting for the screen.
 *
 * @param {RelightablePhotoElement} photo
 * @param {KindName} name
 * @param {number} count
 */
export async function draw(photo, name, count) {
  const change = KINDS[name](photo);
  waitForScreen(false);
  for (let i = 1; i <= count; i += 1) await frame(photo, change, i);
  waitForScreen(true);
}

/**
 * Returns milliseconds a frame when several frames are drawn before one wait. If that is about the time of a frame with
 * its own wait, waiting really waits.
 *
 * @param {RelightablePhotoElement} photo
 * @param {KindName} name
 * @param {number} each
 */
export async function timeTogether(photo, name, each) {
  const change = KINDS[name](photo);
  waitForScreen(false);
  await settled();
  const times = [];
  for (let turn = 0; turn < FEWEST; turn += 1) {
    const start = performance.now();
    for (let i = 0; i < each; i += 1) {
      const drawing = drawn();
      change(i);
      await drawing;
    }
    await finished(photo);
    times.push((performance.now() - start) / each);
  }
  waitForScreen(true);
  return times;
}

/** Returns milliseconds of a wait for a complete picture: the measurement's overhead. @param {RelightablePhotoElement} photo */
export async function timeWaiting(photo) {
  const times = [];
  for (let i = 0; i < FEWEST; i += 1) {
    const start = performance.now();
    await finished(photo);
    times.push(performance.now() - start);
  }
  return times;
}

/**
 * Returns the frames a second that the page shows, at most one for each frame of the screen.
 *
 * @param {RelightablePhotoElement} photo
 * @param {KindName} name
 * @param {number} seconds
 */
export async function showFor(photo, name, seconds) {
  const change = KINDS[name](photo);
  const start = performance.now();
  let frames = 0;
  for (; performance.now() - start < 1000 * seconds; frames += 1) {
    const drawing = drawn();
    change(frames);
    await drawing;
  }
  return frames / ((performance.now() - start) / 1000);
}

/** Counts frames that are drawn while nothing changes. @param {number} seconds */
export async function unasked(seconds) {
  const before = drawCount();
  await new Promise((resolve) => setTimeout(resolve, 1000 * seconds));
  return drawCount() - before;
}
