/** Runs in the page. Measures memory bandwidth: bytes that `count` workers together read and write a second. */

const BYTES = 1 << 28;
const RUNS = 7;

/** @param {number} count */
export async function copyBandwidth(count) {
  const workers = Array.from(
    { length: count },
    () => new Worker(new URL('./copy-worker.js', import.meta.url), { type: 'module' }),
  );
  const all = (/** @type {number} */ bytes) =>
    Promise.all(
      workers.map((worker) => {
        const told = new Promise((resolve) =>
          worker.addEventListener('message', resolve, { once: true }),
        );
        worker.postMessage(bytes);
        return told;
      }),
    );
  await all(Math.floor(BYTES / count));
  let fastest = Number.POSITIVE_INFINITY;
  for (let run = 0; run < RUNS; run += 1) {
    const start = performance.now();
    await all(0);
    fastest = Math.min(fastest, performance.now() - start);
  }
  for (const worker of workers) worker.terminate();
  return (2 * BYTES) / (fastest / 1000);
}
