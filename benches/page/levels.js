/**
 * Measures a photograph of several levels in a page of 1440 × 900 pixels, with the CPU backend: node levels.js FILE.ltm
 * REPORT.json.
 *
 * - the time from the navigation to the first picture, on a line with 10 Mbit/s and 50 ms latency; scripts and modules are
 *   in the browser's cache;
 * - what a view fetches, relative to its visible pixels times the file's mean bytes a pixel of that level;
 * - memory while the view is zoomed and panned: WebAssembly of the page and its workers, and canvases;
 * - frames a second under a moving torch, with adaptive quality.
 */

import { statSync, writeFileSync } from 'node:fs';
import { readFile } from 'node:fs/promises';
import { basename, dirname, join } from 'node:path';
import { chromium } from 'playwright-core';
import { chromiumOptions } from '../../www/tools/chromium.js';
import { listen } from '../../www/tools/serve.js';
import { site } from '../../www/tools/site.js';
import { slowLine } from './line.js';
import { PAGE_SCRIPT, WORKER_SCRIPT } from './wasm-memory.js';

const LINE = { bytesPerSecond: 10e6 / 8, latencyMs: 50 };
const VIEWPORT = { width: 1440, height: 900 };
const TURNS = 5;
const ZOOMS = [1, 4, 16];
const JOURNEY_SECONDS = Number(process.env['JOURNEY_SECONDS'] ?? 60);
const TORCH_SECONDS = 5;
const MB = 1e6;
/** All levels have so many pixels, relative to level 0. */
const ALL_LEVELS = 4 / 3;

const [file = '', report = ''] = process.argv.slice(2);
const dist = join(import.meta.dirname, '../../dist');
/** Bytes of the photograph that were requested. */
let fetched = 0;

const serveSite = site({ photos: dirname(file) });
const server = await listen(async (request, response) => {
  const { pathname } = new URL(request.url ?? '', 'http://localhost');
  const [, first, last] = /^bytes=(\d+)-(\d+)$/.exec(request.headers.range ?? '') ?? [];
  if (last !== undefined) fetched += Number(last) - Number(first) + 1;
  if (pathname === '/levels') {
    response.writeHead(200, { 'Content-Type': 'text/html' }).end(`<!doctype html>
      <html lang="en"><title>Levels</title>
      <style>body { margin: 0 } relightable-photo { width: 100vw; height: 100vh }</style>
      <relightable-photo src="/photos/${basename(file)}" light="torch" zoom="32" backend="cpu" alt=""></relightable-photo>
      <script type="module" src="/relightable-photo/relightable-photo.js"></script>`);
  } else if (/-(worker|relighter)\.js$/.test(pathname)) {
    response.setHeader('Content-Type', 'text/javascript');
    response.end(WORKER_SCRIPT + (await readFile(join(dist, basename(pathname)), 'utf8')));
  } else serveSite(request, response);
}, 0);
const line = await slowLine(Number(new URL(server.url).port), LINE);
// A software renderer that composes the page would take most of both cores, which no visitor's does.
const browser = await chromium.launch(chromiumOptions('--disable-gpu-compositing'));

/** Runs in the page before its scripts. */
const watch = () => {
  const element = () => /** @type {any} */ (document.querySelector('relightable-photo'));
  const canvases = () => [...element().shadowRoot.querySelectorAll('.content canvas')];
  const counts = { frames: 0 };
  const put = CanvasRenderingContext2D.prototype.putImageData;
  CanvasRenderingContext2D.prototype.putImageData = function (/** @type {any[]} */ ...args) {
    // The root's first rows.
    if (this.canvas === canvases()[0] && args[2] === 0) counts.frames += 1;
    return Reflect.apply(put, this, args);
  };
  const shown = new Promise((resolve) => {
    const look = () => {
      if (element()?.quality) resolve(performance.now());
      else requestAnimationFrame(look);
    };
    look();
  });
  Object.assign(globalThis, { element, canvases, counts, shown });
};

const newContext = () => browser.newContext({ viewport: VIEWPORT });

/** @param {string} origin @param {import('playwright-core').BrowserContext} context */
async function open(origin, context) {
  const page = await context.newPage();
  page.setDefaultTimeout(0);
  page.on('pageerror', (error) => console.error(`page: ${error}`));
  await page.addInitScript(PAGE_SCRIPT);
  await page.addInitScript(watch);
  await page.goto(`${origin}/levels`);
  await page.evaluate('shown');
  return page;
}

/** Waits until nothing has been fetched for a while. @param {import('playwright-core').Page} page */
async function settled(page) {
  for (let before = -1; before !== fetched; ) {
    before = fetched;
    await page.waitForTimeout(1500);
  }
}

const median = (/** @type {number[]} */ values) =>
  values.toSorted((a, b) => a - b)[values.length >> 1] ?? Number.NaN;
const origin = server.url.replace(/\/$/, '');
/** @type {Record<string, number>} */
const figures = {};

/** @param {string} name @param {number} value */
function record(name, value) {
  figures[name] = value;
  console.log(`${name.padEnd(32)} ${value.toFixed(2)}`);
}

async function firstPicture() {
  const context = await newContext();
  const times = [];
  // The first round fills the cache.
  for (let turn = 0; turn <= TURNS; turn += 1) {
    const page = await open(line.origin, context);
    if (turn > 0) times.push(Number(await page.evaluate('shown')));
    await page.close();
  }
  await context.close();
  record('first_picture_ms', median(times));
}

async function views() {
  const ratios = /** @type {number[]} */ ([]);
  const rates = /** @type {number[]} */ ([]);
  for (const zoom of ZOOMS) {
    const page = await open(origin, await newContext());
    await settled(page);
    const before = fetched;
    await page.evaluate(`element().view = { zoom: ${zoom}, x: 0.45, y: 0.4 }`);
    await settled(page);
    const { width, height, box, level } = /** @type {any} */ (
      await page.evaluate(`({ ...element().info, box: element().toElement(1, 1).x - element().toElement(0, 0).x,
        level: Math.min(...canvases().slice(1).map((c) => -Number(c.style.zIndex))) })`)
    );
    const visible =
      Math.min(VIEWPORT.width, box) * Math.min(VIEWPORT.height, box * (height / width));
    const pixels = visible * (width / 2 ** level / box) ** 2;
    const bytesPerPixel = statSync(file).size / (ALL_LEVELS * width * height);
    // At zoom 1 the page has fetched the root and the view already.
    const bytes = zoom === 1 ? before : fetched - before;
    ratios.push(bytes / (pixels * bytesPerPixel));
    const frames = /** @type {number} */ (
      await page.evaluate(`(async () => {
        const start = performance.now();
        const first = counts.frames;
        for (let now = start; now - start < ${1000 * TORCH_SECONDS}; now = performance.now()) {
          const angle = now / 400;
          element().torch = { x: element().view.x + 0.2 * Math.sin(angle) / ${zoom}, y: element().view.y + 0.2 * Math.cos(angle) / ${zoom} };
          await new Promise(requestAnimationFrame);
        }
        return counts.frames - first;
      })()`)
    );
    rates.push(frames / TORCH_SECONDS);
    const quality = await page.evaluate('element().quality');
    const shards = await page.evaluate('canvases().length - 1');
    console.log(
      `zoom ${zoom}: level ${level}, ${shards} shards, ${(bytes / MB).toFixed(2)} MB fetched, ` +
        `${(frames / TORCH_SECONDS).toFixed(1)} frames a second with ${quality} of the components`,
    );
    await page.context().close();
    fetched = 0;
  }
  record('bytes_over_visible', Math.max(...ratios));
  record('torch_fps', Math.min(...rates));
}

async function journey() {
  const page = await open(origin, await newContext());
  const peaks = /** @type {number[]} */ (
    await page.evaluate(`(async () => {
      const peaks = [];
      let peak = 0;
      const start = performance.now();
      let step = 0;
      for (let now = start; now - start < ${1000 * JOURNEY_SECONDS}; now = performance.now()) {
        // Every three seconds another place and magnification, the torch all the time.
        const next = Math.floor((now - start) / 3000);
        if (next > step) {
          step = next;
          const zoom = 2 ** (step * 7 % 5);
          element().viewTo({ zoom, x: step * 0.37 % 1, y: step * 0.61 % 1 }, { duration: 1000 });
        }
        element().torch = { x: 0.5 + 0.4 * Math.sin(now / 700), y: 0.5 + 0.4 * Math.cos(now / 900) };
        await new Promise(requestAnimationFrame);
        const pictures = canvases().reduce((sum, { width, height }) => sum + 4 * width * height, 0);
        peak = Math.max(peak, usage.now + pictures);
        if (peaks.length < Math.floor((now - start) / ${250 * JOURNEY_SECONDS})) {
          peaks.push(peak);
          peak = 0;
        }
      }
      return [...peaks, peak];
    })()`)
  );
  console.log(`memory by quarter: ${peaks.map((bytes) => (bytes / MB).toFixed(0)).join(', ')} MB`);
  record('page_memory_mb', Math.max(...peaks) / MB);
  record('page_memory_growth', (peaks.at(-1) ?? 0) / (peaks[1] ?? 1));
  await page.context().close();
}

try {
  await firstPicture();
  fetched = 0;
  await views();
  await journey();
} finally {
  await browser.close();
  line.close();
  await server.close();
}
if (report) writeFileSync(report, `${JSON.stringify({ figures }, null, 2)}\n`);
