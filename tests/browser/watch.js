/**
 * For pages to run first: keeps what a page complains of in `complaints`, as not every browser tells the
 * test of it, in `memories` the memory of each WebAssembly module that it starts, and in `workers` what has
 * come from each worker.
 */
export function watch() {
  /** @type {string[]} */
  const complaints = [];
  /** @type {WebAssembly.Memory[]} */
  const memories = [];
  /** @type {{ url: string, answers: number, failed: boolean }[]} */
  const workers = [];
  Object.assign(globalThis, { complaints, memories, workers });
  globalThis.Worker = class extends Worker {
    /** @param {string | URL} url @param {WorkerOptions} [options] */
    constructor(url, options) {
      super(url, options);
      const worker = { url: String(url), answers: 0, failed: false };
      workers.push(worker);
      this.addEventListener('message', () => {
        worker.answers += 1;
      });
      this.addEventListener('error', () => {
        worker.failed = true;
      });
    }
  };
  // Captured, as errors of what is loaded do not bubble; these are the page's own affair.
  addEventListener('error', (event) => {
    if (event.target === globalThis) complaints.push(event.message);
  });
  addEventListener('unhandledrejection', ({ reason }) => complaints.push(String(reason)));
  addEventListener('securitypolicyviolation', ({ violatedDirective, blockedURI }) =>
    complaints.push(`${violatedDirective} does not allow ${blockedURI}`),
  );
  for (const level of /** @type {const} */ (['error', 'warn'])) {
    const say = console[level];
    console[level] = (...said) => {
      complaints.push(`${level}: ${said.join(' ')}`);
      say.apply(console, said);
    };
  }
  for (const start of /** @type {const} */ (['instantiate', 'instantiateStreaming'])) {
    const own = WebAssembly[start];
    WebAssembly[start] = /** @type {any} */ (
      async (/** @type {any[]} */ ...args) => {
        const started = await Reflect.apply(own, WebAssembly, args);
        const { exports } = started.instance ?? started;
        memories.push(exports.memory);
        return started;
      }
    );
  }
}
