/**
 * Runs in a page before its own scripts, and in its workers: follows the WebAssembly memory of all of them. A worker
 * reports its memory before each message that it sends, and every 50 ms; one that is terminated counts no more.
 *
 * `globalThis.usage` has the bytes now and at their peak, and the photographs that workers have decoded.
 */

/** Makes a thread report its bytes of WebAssembly memory to `report`. @param {(bytes: number) => void} report */
function followMemory(report) {
  /** @type {WebAssembly.Memory[]} */
  const memories = [];
  for (const name of /** @type {const} */ (['instantiate', 'instantiateStreaming'])) {
    const instantiate = WebAssembly[name];
    WebAssembly[name] = /** @type {any} */ (
      async (/** @type {any[]} */ ...args) => {
        const result = await Reflect.apply(instantiate, WebAssembly, args);
        memories.push((result.instance ?? result).exports.memory);
        return result;
      }
    );
  }
  const measure = () => report(memories.reduce((sum, { buffer }) => sum + buffer.byteLength, 0));
  setInterval(measure, 50);
  return measure;
}

/** @param {(report: (bytes: number) => void) => unknown} follow `followMemory` */
function monitorPage(follow) {
  const PAGE = 0;
  /** Bytes by thread. @type {Map<number, number>} */
  const bytes = new Map();
  const usage = { now: 0, peak: 0, decoded: 0, workers: 0 };
  Object.assign(globalThis, { usage });
  const set = (/** @type {number} */ thread, /** @type {number | null} */ size) => {
    if (size === null) bytes.delete(thread);
    else bytes.set(thread, size);
    usage.workers = bytes.size - 1;
    usage.now = [...bytes.values()].reduce((sum, size) => sum + size, 0);
    usage.peak = Math.max(usage.peak, usage.now);
  };
  set(PAGE, 0);
  follow((size) => set(PAGE, size));
  let last = PAGE;
  globalThis.Worker = class extends Worker {
    #id;

    /** @param {string | URL} url @param {WorkerOptions} [options] */
    constructor(url, options) {
      last += 1;
      super(`${url}#${last}`, options);
      this.#id = last;
      set(this.#id, 0);
      this.addEventListener('message', (event) => {
        if (typeof event.data?.wasmBytes !== 'number') return;
        event.stopImmediatePropagation();
        if (bytes.has(this.#id)) set(this.#id, event.data.wasmBytes);
      });
    }

    /** @override @param {any} message @param {any} transfer */
    postMessage(message, transfer) {
      if (message?.task?.kind === 'finish') usage.decoded += 1;
      super.postMessage(message, transfer);
    }

    /** @override */
    terminate() {
      set(this.#id, null);
      super.terminate();
    }
  };
}

/** @param {(report: (bytes: number) => void) => () => void} follow `followMemory` */
function monitorWorker(follow) {
  const scope = /** @type {any} */ (globalThis);
  const send = scope.postMessage.bind(scope);
  const measure = follow((wasmBytes) => send({ wasmBytes }));
  scope.postMessage = (/** @type {any[]} */ ...message) => {
    measure();
    send(...message);
  };
}

/** For `page.addInitScript`. */
export const PAGE_SCRIPT = `(${monitorPage})(${followMemory})`;
/** Put it before the scripts of workers. */
export const WORKER_SCRIPT = `(${monitorWorker})(${followMemory});\n`;
