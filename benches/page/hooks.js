/**
 * Loaded before the element. Reports when the element has drawn, runs frames faster than the screen, and counts
 * graphics devices and contexts. With `?workers=N` the page sees N cores.
 */

/** @typedef {'webgpu' | 'webgl2' | 'cpu'} Backend */

const workers = new URLSearchParams(location.search).get('workers');
if (workers) {
  Object.defineProperty(Navigator.prototype, 'hardwareConcurrency', { get: () => Number(workers) });
}

/** Live graphics devices. */
export const devices = /** @type {Set<GPUDevice>} */ (new Set());
const contexts = /** @type {Set<WeakRef<WebGL2RenderingContext>>} */ (new Set());

/** Number of WebGL2 contexts that are not lost. */
export const liveContexts = () =>
  [...contexts].filter((context) => context.deref()?.isContextLost() === false).length;

/** Number of drawn frames, and the callbacks that wait for the next. */
let draws = 0;
let waiting = /** @type {(() => void)[]} */ ([]);

export const drawCount = () => draws;

function drew() {
  draws += 1;
  const told = waiting;
  waiting = [];
  for (const tell of told) tell();
}

/** Resolves when a whole picture is drawn; drawing is never interrupted. */
export const drawn = () => new Promise((resolve) => waiting.push(() => resolve(undefined)));

/**
 * Wraps a method so that `after` is called whenever it has returned.
 *
 * @param {any} type
 * @param {string} name
 * @param {(target: any) => void} after
 */
function watch(type, name, after) {
  const method = type?.prototype[name];
  if (!method) return;
  /** @this {any} @param {any[]} args */
  type.prototype[name] = function (...args) {
    const result = Reflect.apply(method, this, args);
    after(this);
    return result;
  };
}

/** Counts frames on canvases that elements show, not on those that read light images. @param {CanvasRenderingContext2D} context */
const shown = ({ canvas }) => {
  if (canvas.getRootNode() instanceof ShadowRoot) drew();
};
watch(globalThis.CanvasRenderingContext2D, 'putImageData', shown);
watch(globalThis.CanvasRenderingContext2D, 'drawImage', shown);
watch(globalThis.GPUQueue, 'submit', drew);

const { getContext } = HTMLCanvasElement.prototype;
HTMLCanvasElement.prototype.getContext = /** @type {any} */ (
  /** @this {HTMLCanvasElement} @param {string} kind @param {any[]} rest */
  function (kind, ...rest) {
    const context = Reflect.apply(getContext, this, [kind, ...rest]);
    if (kind === 'webgl2' && context) contexts.add(new WeakRef(context));
    return context;
  }
);
if (globalThis.GPUAdapter) {
  const { requestDevice } = GPUAdapter.prototype;
  GPUAdapter.prototype.requestDevice = async function (...args) {
    const device = await Reflect.apply(requestDevice, this, args);
    devices.add(device);
    device.lost.then(() => devices.delete(device));
    return device;
  };
}

const { port1, port2 } = new MessageChannel();
let callbacks = /** @type {FrameRequestCallback[]} */ ([]);
port1.onmessage = () => {
  const called = callbacks;
  callbacks = [];
  for (const callback of called) callback(performance.now());
};
const nextOnScreen = globalThis.requestAnimationFrame.bind(globalThis);
let onScreen = true;

/** Chooses whether frames wait for the screen, as in every page, or follow at once. @param {boolean} wait */
export function waitForScreen(wait) {
  onScreen = wait;
}

globalThis.requestAnimationFrame = (callback) => {
  if (onScreen) return nextOnScreen(callback);
  callbacks.push(callback);
  if (callbacks.length === 1) port2.postMessage(null);
  return 0;
};
