/**
 * Runs in a page before its own scripts. Records in globals what browser drivers do not report everywhere:
 * `complaints` has errors, warnings and policy violations, `memories` the memory of each WebAssembly instance of the
 * page, `workers` the messages and errors of each worker.
 */
export function monitorPage() {
  /** @type {string[]} */
  const complaints = [];
  /** @type {WebAssembly.Memory[]} */
  const memories = [];
  /** @type {{ url: string, messages: number, failed: boolean }[]} */
  const workers = [];
  Object.assign(globalThis, { complaints, memories, workers });
  globalThis.Worker = class extends Worker {
    /** @param {string | URL} url @param {WorkerOptions} [options] */
    constructor(url, options) {
      super(url, options);
      const worker = { url: String(url), messages: 0, failed: false };
      workers.push(worker);
      this.addEventListener('message', () => {
        worker.messages += 1;
      });
      this.addEventListener('error', () => {
        worker.failed = true;
      });
    }
  };
  // Errors of resources have an element as their target; tests expect some of those.
  addEventListener('error', (event) => {
    if (event.target === globalThis) complaints.push(event.message);
  });
  addEventListener('unhandledrejection', ({ reason }) => complaints.push(String(reason)));
  addEventListener('securitypolicyviolation', ({ violatedDirective, blockedURI }) =>
    complaints.push(`${violatedDirective} does not allow ${blockedURI}`),
  );
  for (const level of /** @type {const} */ (['error', 'warn'])) {
    const log = console[level];
    console[level] = (...values) => {
      complaints.push(`${level}: ${values.join(' ')}`);
      log.apply(console, values);
    };
  }
  for (const name of /** @type {const} */ (['instantiate', 'instantiateStreaming'])) {
    const instantiate = WebAssembly[name];
    WebAssembly[name] = /** @type {any} */ (
      async (/** @type {any[]} */ ...args) => {
        const result = await Reflect.apply(instantiate, WebAssembly, args);
        const { exports } = result.instance ?? result;
        memories.push(exports.memory);
        return result;
      }
    );
  }
}
