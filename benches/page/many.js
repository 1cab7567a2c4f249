/**
 * Measures many photographs on one page, with the CPU backend: node many.js PHOTOS REPORT.json [PART...], where PHOTOS is
 * the demo's folder. The parts:
 *
 * - `view`: 30 elements of the cookies in view; the time from the navigation to the first whole picture, and the longest
 *   time between two of them;
 * - `scroll`: 60 elements of the cookies and 60 of the window on a page that is scrolled down and up again; errors,
 *   elements without a picture, WebAssembly memory of the page and its workers at its peak, requests and decodings;
 * - `busy`: the same while another process keeps each core busy;
 * - `memory`: what loaded photographs add to the browser's processes (proportional set size): one of the cookies, thirty
 *   of them, one of the window, ten of them.
 *
 * `view` and `scroll` are measured twice: with one address for each scene, and with an address for each element, as if
 * all photographs were different ones. Targets are printed beside the figures; the exit status does not depend on them.
 */

import { spawn } from 'node:child_process';
import { readdirSync, readFileSync, writeFileSync } from 'node:fs';
import { availableParallelism } from 'node:os';
import { join } from 'node:path';
import { setTimeout as sleep } from 'node:timers/promises';
import { launchChromium } from '../../www/tools/chromium.js';
import { listen } from '../../www/tools/serve.js';
import { site } from '../../www/tools/site.js';
import { PAGE_SCRIPT, WORKER_SCRIPT } from './wasm-memory.js';

const MB = 1e6;
const PARTS = ['view', 'scroll', 'busy', 'memory'];
const TARGETS = {
  first_whole_ms: 2000,
  longest_gap_ms: 800,
  errors: 0,
  missing: 0,
  wasm_peak_mb: 600,
  added_mb: 64,
};
/** How long the elements of a page may take to draw. */
const LONGEST_WAIT_MS = 480_000;
const SCROLL_STEP_PX = 400;
const SCROLL_PAUSE_MS = 300;

const [photos = '', report = '', ...chosen] = process.argv.slice(2);
const parts = chosen.length > 0 ? chosen : PARTS;

const dist = join(import.meta.dirname, '../../dist');
/** Requests for photographs from their first byte, by address. @type {Map<string, number>} */
const fetches = new Map();

const serveSite = site({ photos });
const server = await listen((request, response) => {
  const { pathname, searchParams } = new URL(request.url ?? '', 'http://localhost');
  if (pathname === '/many') {
    response.writeHead(200, { 'Content-Type': 'text/html' }).end(pageOf(searchParams));
  } else if (/-(worker|relighter)\.js$/.test(pathname)) {
    response.setHeader('Content-Type', 'text/javascript');
    response.end(
      WORKER_SCRIPT + readFileSync(join(dist, pathname.split('/').at(-1) ?? ''), 'utf8'),
    );
  } else {
    const url = request.url ?? '';
    if (url.includes('.ltm') && (request.headers.range ?? 'bytes=0-').startsWith('bytes=0-')) {
      fetches.set(url, (fetches.get(url) ?? 0) + 1);
    }
    // As hosts of files do it.
    if (url.includes('.ltm')) response.setHeader('Cache-Control', 'max-age=3600');
    serveSite(request, response);
  }
}, 0);

/** @param {URLSearchParams} options numbers of elements of each scene, `side` of each, `distinct` addresses */
function pageOf(options) {
  const elements = [];
  const side = Number(options.get('side'));
  for (const scene of ['cookies', 'stained-glass']) {
    for (let i = 0; i < Number(options.get(scene) ?? 0); i += 1) {
      const src = `/photos/${scene}.ltm${options.has('distinct') ? `?${i}` : ''}`;
      elements.push(
        `<relightable-photo src="${src}" backend="cpu" light="flood" loading="eager" alt=""></relightable-photo>`,
      );
    }
  }
  return `<!doctype html><html lang="en"><title>Many</title>
    <style>
      body { margin: 0; display: flex; flex-wrap: wrap }
      relightable-photo { display: block; width: ${side}px; height: ${side}px }
    </style>
    ${elements.join('\n')}
    <script type="module" src="/relightable-photo/relightable-photo.js"></script>`;
}

/** Runs in the page before its scripts: times of `load`, by element, and errors. */
const watch = () => {
  /** @type {Map<EventTarget | null, number>} */
  const loads = new Map();
  /** @type {string[]} */
  const errors = [];
  Object.assign(globalThis, { loads, errors });
  const isPhoto = (/** @type {Event} */ { target }) =>
    /** @type {Element} */ (target).localName === 'relightable-photo';
  document.addEventListener(
    'load',
    (event) => {
      if (isPhoto(event) && !loads.has(event.target)) loads.set(event.target, performance.now());
    },
    true,
  );
  document.addEventListener(
    'error',
    (event) => {
      if (isPhoto(event)) errors.push(`${/** @type {any} */ (event).code}: ${event.message}`);
    },
    true,
  );
};

const browser = await launchChromium();

/**
 * Opens a page with elements.
 *
 * @param {Record<string, string | number>} options
 */
async function open(options) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 720 } });
  const page = await context.newPage();
  page.setDefaultTimeout(LONGEST_WAIT_MS);
  page.on('pageerror', (error) => console.error(`page: ${error}`));
  await page.addInitScript(PAGE_SCRIPT);
  await page.addInitScript(watch);
  const query = new URLSearchParams(
    Object.entries(options).map(([name, value]) => [name, String(value)]),
  );
  await page.goto(`${server.url}many?${query}`);
  return page;
}

/** Waits until each element has loaded or failed. @param {import('playwright-core').Page} page @param {number} count */
const settled = (page, count) =>
  page.waitForFunction(
    (count) => {
      const { loads, errors } = /** @type {any} */ (globalThis);
      return loads.size + errors.length >= count;
    },
    count,
    { polling: 100 },
  );

/** @param {import('playwright-core').Page} page */
const usageOf = async (page) => {
  const usage = /** @type {{ now: number, peak: number, decoded: number }} */ (
    await page.evaluate('usage')
  );
  return { wasm_mb: usage.now / MB, wasm_peak_mb: usage.peak / MB, decoded: usage.decoded };
};

/** @param {import('playwright-core').Page} page @returns {Promise<string[]>} */
const errorsOf = async (page) => [
  ...new Set(/** @type {string[]} */ (await page.evaluate('errors'))),
];

/** @type {Record<string, number>} */
const figures = {};

/** Prints figures beside their targets. @param {string} name @param {Record<string, number>} values */
function show(name, values) {
  console.log(`\n${name}`);
  for (const [key, value] of Object.entries(values)) {
    const target = /** @type {Record<string, number>} */ (TARGETS)[key];
    const verdict =
      target === undefined ? '' : ` (target ${target}: ${value <= target ? 'ok' : 'MISSED'})`;
    console.log(`  ${key.padEnd(16)} ${String(Math.round(10 * value) / 10).padStart(8)}${verdict}`);
    figures[`${name.replaceAll(/\W+/g, '_')}_${key}`] = value;
  }
}

/** @param {Record<string, string | number>} addresses */
async function measureView(addresses) {
  const page = await open({ cookies: 30, side: 120, ...addresses });
  await settled(page, 30);
  const times = /** @type {number[]} */ (await page.evaluate('[...loads.values()]'));
  const errors = await errorsOf(page);
  for (const error of errors) console.log(error);
  const usage = await usageOf(page);
  await page.context().close();
  const gaps = times.map((ms, i) => ms - (times[i - 1] ?? ms));
  return {
    first_whole_ms: times[0] ?? Number.NaN,
    longest_gap_ms: Math.max(...gaps),
    last_whole_ms: times.at(-1) ?? Number.NaN,
    errors: errors.length,
    ...usage,
  };
}

/** @param {Record<string, string | number>} addresses */
async function measureScroll(addresses) {
  fetches.clear();
  const page = await open({ cookies: 60, 'stained-glass': 60, side: 300, ...addresses });
  const height = Number(await page.evaluate('document.body.scrollHeight'));
  const down = Array.from({ length: Math.ceil(height / SCROLL_STEP_PX) }, (_, i) => i);
  for (const step of [...down, ...down.toReversed()]) {
    await page.evaluate(`scrollTo(0, ${step * SCROLL_STEP_PX})`);
    await sleep(SCROLL_PAUSE_MS);
  }
  await settled(page, 120);
  const missing = await page.evaluate(() => {
    const photos = [...document.querySelectorAll('relightable-photo')];
    const isDrawn = (/** @type {Element} */ photo) => {
      const canvas = photo.shadowRoot?.querySelector('canvas');
      const small = new OffscreenCanvas(4, 4).getContext('2d');
      if (!canvas || !small) return false;
      small.drawImage(canvas, 0, 0, 4, 4);
      return small.getImageData(0, 0, 4, 4).data.some((value, i) => i % 4 < 3 && value > 32);
    };
    return photos.filter((photo) => !isDrawn(photo)).length;
  });
  const errors = await errorsOf(page);
  for (const error of errors) console.log(error);
  const usage = await usageOf(page);
  await page.context().close();
  return {
    errors: errors.length,
    missing,
    ...usage,
    addresses: fetches.size,
    fetched: [...fetches.values()].reduce((sum, count) => sum + count, 0),
  };
}

/** Keeps each core busy while `work` runs. @template T @param {() => Promise<T>} work @returns {Promise<T>} */
async function whileBusy(work) {
  const spinners = Array.from({ length: availableParallelism() }, () =>
    spawn(process.execPath, ['-e', 'const { ppid } = process; while (process.ppid === ppid);'], {
      stdio: 'ignore',
    }),
  );
  try {
    return await work();
  } finally {
    for (const spinner of spinners) spinner.kill('SIGKILL');
  }
}

/** Bytes of all descendants of this process: proportional set size, which counts shared pages once. */
function browserBytes() {
  /** @type {Map<number, number[]>} */
  const children = new Map();
  for (const name of readdirSync('/proc').filter((name) => /^\d+$/.test(name))) {
    try {
      const stat = readFileSync(`/proc/${name}/stat`, 'utf8');
      const parent = Number(stat.slice(stat.lastIndexOf(')') + 2).split(' ')[1]);
      children.set(parent, [...(children.get(parent) ?? []), Number(name)]);
    } catch {
      // It has ended.
    }
  }
  /** @param {number} pid @returns {number} */
  const sum = (pid) =>
    (children.get(pid) ?? []).reduce((bytes, child) => bytes + pss(child) + sum(child), 0);
  return sum(process.pid);
}

/** @param {number} pid */
function pss(pid) {
  try {
    const kb = /^Pss:\s+(\d+) kB/m.exec(readFileSync(`/proc/${pid}/smaps_rollup`, 'utf8'))?.[1];
    return 1024 * Number(kb ?? 0);
  } catch {
    return 0;
  }
}

/** The bytes once they no longer fall: browsers return memory late. */
async function settledBytes() {
  let least = browserBytes();
  for (let rest = 0; rest < 5; rest += 1) {
    await sleep(1000);
    const bytes = browserBytes();
    if (bytes < 0.99 * least) rest = 0;
    least = Math.min(least, bytes);
  }
  return least;
}

/** @param {string} scene @param {number} count */
async function measureMemory(scene, count) {
  // The modules are loaded, but no photograph.
  const page = await open({ side: 120 });
  await page.evaluate(() => customElements.whenDefined('relightable-photo'));
  const before = await settledBytes();
  await page.evaluate(
    ({ scene, count }) => {
      for (let i = 0; i < count; i += 1) {
        const photo = document.createElement('relightable-photo');
        for (const [name, value] of Object.entries({
          src: `/photos/${scene}.ltm?${i}`,
          backend: 'cpu',
          light: 'flood',
          loading: 'eager',
        })) {
          photo.setAttribute(name, value);
        }
        document.body.append(photo);
      }
    },
    { scene, count },
  );
  await settled(page, count);
  const after = await settledBytes();
  const { wasm_mb } = await usageOf(page);
  const decoded = await page.evaluate(
    'document.querySelector("relightable-photo").info.decodedBytes',
  );
  await page.context().close();
  return { added_mb: (after - before) / MB / count, wasm_mb, decoded_mb: Number(decoded) / MB };
}

const ADDRESSES = { 'one address': {}, 'an address each': { distinct: 1 } };

try {
  // Fills the disk's cache and starts the browser's processes.
  await measureView({});
  for (const [name, addresses] of Object.entries(ADDRESSES)) {
    if (parts.includes('view')) show(`view, ${name}`, await measureView(addresses));
    if (parts.includes('scroll')) show(`scroll, ${name}`, await measureScroll(addresses));
    if (parts.includes('busy')) {
      show(`busy, ${name}`, await whileBusy(() => measureScroll(addresses)));
    }
  }
  if (parts.includes('memory')) {
    show('memory, one of the cookies', await measureMemory('cookies', 1));
    for (const [scene, count] of /** @type {const} */ ([
      ['cookies', 30],
      ['stained-glass', 1],
      ['stained-glass', 10],
    ])) {
      // The target is that of one cookies photograph.
      const { added_mb: each_mb, ...rest } = await measureMemory(scene, count);
      show(`memory, ${scene}, ${count}`, { each_mb, ...rest });
    }
  }
} finally {
  await browser.close();
  await server.close();
}
if (report) {
  writeFileSync(report, `${JSON.stringify({ figures }, null, 2)}\n`);
  console.log(`\n${report}`);
}
