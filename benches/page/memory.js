/** Measures the memory of elements, and what remains after they are removed. */

import { inPage, isSoftware, openPage } from './pages.js';

/** @typedef {import('playwright-core').Page} Page */
/** @typedef {import('./hooks.js').Backend} Backend */

const FRAMES = 10_000;
/** Software renderers are slow. */
const FEWER_FRAMES = 1000;
const CYCLES = 200;
const MB = 1e6;

/** Sums the WebAssembly memory of the page and of its relighting workers. @param {Page} page */
async function modules(page) {
  /** @param {readonly string[]} loaded */
  const bytes = async (loaded) => {
    let sum = 0;
    for (const module of loaded) {
      sum += (await (await import(module)).default()).memory.buffer.byteLength;
    }
    return sum;
  };
  const loaded = await page.evaluate(() =>
    performance
      .getEntriesByType('resource')
      .map(({ name }) => name)
      .filter((name) => /\/wasm\/\w+\.js$/.test(name)),
  );
  const relighters = page.workers().filter((worker) => worker.url().includes('relighter'));
  return Promise.all([
    page.evaluate(bytes, loaded),
    ...relighters.map((worker) =>
      worker
        .evaluate('memories.reduce((sum, { buffer }) => sum + buffer.byteLength, 0)')
        .then(Number),
    ),
  ]);
}

/** Counts a page's memory and objects after garbage collection. @param {Page} page */
async function holdings(page) {
  const session = await page.context().newCDPSession(page);
  // Twice: objects that the browser's own objects hold are released by the second collection.
  for (let i = 0; i < 2; i += 1) await session.send('HeapProfiler.collectGarbage');
  await page.waitForTimeout(200);
  await session.send('HeapProfiler.collectGarbage');
  const usage = /** @type {any} */ (await session.send('Runtime.getHeapUsage'));
  const { nodes, jsEventListeners } = await session.send('Memory.getDOMCounters');
  await session.detach();
  const wasm = (await modules(page)).reduce((sum, bytes) => sum + bytes, 0);
  const [contexts, devices] = await inPage(page, async ({ hooks }) => [
    hooks.liveContexts(),
    hooks.devices.size,
  ]);
  return {
    wasm_mb: wasm / MB,
    heap_mb: usage.usedSize / MB,
    buffers_mb: (usage.backingStorageSize ?? 0) / MB,
    nodes,
    listeners: jsEventListeners,
    contexts,
    devices,
    workers: page.workers().length,
  };
}

/** @typedef {Awaited<ReturnType<typeof holdings>>} Holdings */

/**
 * Prints the first and the last holdings and returns the growth.
 *
 * @param {string} name
 * @param {Holdings} first
 * @param {Holdings} last
 */
function report(name, first, last) {
  const keys = /** @type {(keyof Holdings)[]} */ (Object.keys(first));
  const text = keys.map((key) => `${key} ${short(first[key])} → ${short(last[key])}`);
  console.log(`${name}\n    ${text.join(', ')}`);
  return Object.fromEntries(
    keys.map((key) => [`${name.replaceAll(' ', '_')}_more_${key}`, last[key] - first[key]]),
  );
}

const short = (/** @type {number} */ value) => String(Math.round(100 * value) / 100);

/**
 * Measures the WebAssembly memory of the CPU backend with two workers, relative to the photograph's decoded bytes: when the
 * photograph is shown, and after frames of each kind.
 *
 * @param {string} src
 * @param {string} name
 */
async function overDecoded(src, name) {
  const page = await openPage({ workers: 2 });
  const decoded = await inPage(
    page,
    async ({ frames }, src) => (await frames.mount(src, 'cpu')).info?.decodedBytes ?? Number.NaN,
    src,
  );
  /** @type {Record<string, number>} */
  const figures = {};
  for (const kind of /** @type {const} */ (['loaded', 'torch', 'video'])) {
    if (kind !== 'loaded') await inPage(page, drawSome, kind);
    const bytes = await modules(page);
    const total = bytes.reduce((sum, n) => sum + n, 0);
    const percent = 100 * (total / decoded - 1);
    const [own, ...crew] = bytes.map((n) => short(n / MB));
    console.log(
      `${name} ${kind}: wasm memory ${short(total / MB)} MB (page ${own}, workers ${crew.join(' and ')}), ` +
        `decoded ${short(decoded / MB)} MB: ${percent.toFixed(1)} % over`,
    );
    figures[`memory_over_decoded_${name}_${kind}_percent`] = percent;
  }
  await page.context().close();
  return figures;
}

/** Runs in the page. @param {import('./pages.js').Modules} modules @param {'torch' | 'video'} kind */
async function drawSome({ frames }, kind) {
  const photo = document.querySelector('relightable-photo');
  if (photo) await frames.draw(photo, kind, 20);
}

/**
 * Measures the growth over many frames with a moving torch.
 *
 * @param {string} src
 * @param {Backend} backend
 */
async function overFrames(src, backend) {
  const page = await openPage({});
  const draw = (/** @type {number} */ count) =>
    inPage(
      page,
      async ({ frames }, { src, backend, count }) => {
        const photo = document.querySelector('relightable-photo');
        await frames.draw(photo ?? (await frames.mount(src, backend)), 'torch', count);
      },
      { src, backend, count },
    );
  await draw(100);
  const kernel = await page.evaluate("document.querySelector('relightable-photo').kernel");
  const frames = isSoftware(String(kernel)) ? FEWER_FRAMES : FRAMES;
  const first = await holdings(page);
  await draw(frames);
  const last = await holdings(page);
  await page.context().close();
  return report(`${frames} frames ${backend}`, first, last);
}

/**
 * Measures the growth over many elements that are added and removed. None exists at either measurement.
 *
 * @param {string} src
 * @param {Backend} backend
 */
async function overCycles(src, backend) {
  const page = await openPage({});
  const cycle = (/** @type {number} */ count) =>
    inPage(
      page,
      async ({ frames }, { src, backend, count }) => {
        for (let i = 0; i < count; i += 1) {
          const photo = await frames.mount(src, backend);
          await frames.draw(photo, 'torch', 2);
          photo.remove();
          await new Promise((resolve) => setTimeout(resolve));
        }
      },
      { src, backend, count },
    );
  await cycle(10);
  const first = await holdings(page);
  await cycle(CYCLES);
  const last = await holdings(page);
  await page.context().close();
  return report(`${CYCLES} cycles ${backend}`, first, last);
}

/**
 * @param {string} small address of a small photograph, for many frames
 * @param {readonly { name: string, src: string }[]} held photographs whose memory is compared with their decoded size
 */
export async function memory(small, held) {
  console.log('\nMemory, after garbage is collected, first and last:\n');
  /** @type {Record<string, number>} */
  const figures = {};
  for (const { name, src } of held) Object.assign(figures, await overDecoded(src, name));
  for (const backend of /** @type {const} */ (['cpu', 'webgl2', 'webgpu'])) {
    Object.assign(figures, await overFrames(small, backend));
    Object.assign(figures, await overCycles(small, backend));
  }
  return figures;
}
