/**
 * Measures the time to the first picture: node first.js PHOTOS REPORT.json, where PHOTOS is the demo's folder.
 *
 * The line has 10 Mbit/s and 50 ms latency. Scripts and modules are in the browser's cache and are revalidated; the
 * photograph is not cached. Times run from the navigation, and from setting `src` on a page that has relit a
 * photograph before, to the first relit picture, which may be coarse, and to the whole photograph. The peer is a PNG
 * of one picture over the same line, from the navigation to its `load` event.
 */

import { statSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { launchChromium } from '../../www/tools/chromium.js';
import { listen } from '../../www/tools/serve.js';
import { site } from '../../www/tools/site.js';
import { slowLine } from './line.js';

const LINE = { bytesPerSecond: 10e6 / 8, latencyMs: 50 };
const TURNS = 5;

const [photos = '', report = ''] = process.argv.slice(2);
const GLASS = 'stained-glass';

const PAGES = {
  '/photo': `<relightable-photo src="/photos/${GLASS}.ltm?TURN" loading="eager"></relightable-photo>
    <script type="module" src="/relightable-photo/relightable-photo.js"></script>`,
  '/picture': `<img id="picture" src="/photos/${GLASS}-flood.png?TURN" alt="">`,
};

const serveSite = site({ photos });
const server = await listen((request, response) => {
  const { pathname, search } = new URL(request.url ?? '', 'http://localhost');
  const body = /** @type {Record<string, string>} */ (PAGES)[pathname];
  if (body === undefined) serveSite(request, response);
  else {
    response.writeHead(200, { 'Content-Type': 'text/html' });
    response.end(
      `<!doctype html><html lang="en"><title>First</title>${body.replace('TURN', search.slice(1))}`,
    );
  }
}, 0);
const line = await slowLine(Number(new URL(server.url).port), LINE);
const browser = await launchChromium();

/** Runs in the page. Records the times of the first picture and of the whole photograph. */
const watch = () => {
  const times = /** @type {any} */ ({
    began: document.readyState === 'loading' ? 0 : performance.now(),
  });
  Object.assign(globalThis, { times });
  times.shown = new Promise((resolve) => {
    const look = () => {
      const photo = /** @type {any} */ (document.querySelector('relightable-photo'));
      if (photo?.quality) resolve(performance.now() - times.began);
      else requestAnimationFrame(look);
    };
    look();
  });
  times.whole = new Promise((resolve, reject) => {
    const tell = (/** @type {Event} */ { target }) => {
      if (/** @type {Element} */ (target).localName !== 'relightable-photo') return;
      document.removeEventListener('load', tell, true);
      resolve(performance.now() - times.began);
    };
    document.addEventListener('load', tell, true);
    document.addEventListener('error', ({ message }) => reject(new Error(message)), true);
  });
};

/** Runs in the page. Loads another photograph and returns its times. @param {() => void} watch @param {string} src */
const begin = async (watch, src) => {
  const photo = /** @type {any} */ (document.querySelector('relightable-photo'));
  const began = performance.now();
  photo.src = src;
  // The element keeps its old picture until it starts to load.
  await Promise.resolve();
  watch();
  const { times } = /** @type {any} */ (globalThis);
  times.began = began;
  return { first: await times.shown, whole: await times.whole };
};

/** @param {number[]} values */
const median = (values) => values.toSorted((a, b) => a - b)[values.length >> 1] ?? Number.NaN;

/** @type {Record<string, number[]>} */
const times = { navigation_first: [], navigation_whole: [], src_first: [], src_whole: [], png: [] };

try {
  const context = await browser.newContext();
  // The first round fills the caches.
  for (let turn = 0; turn <= TURNS; turn += 1) {
    const page = await context.newPage();
    await page.addInitScript(watch);
    await page.goto(`${line.origin}/photo?${turn}`);
    const first = await page.evaluate('times.shown');
    const whole = await page.evaluate('times.whole');
    const later = await page.evaluate(`(${begin})(${watch}, '/photos/${GLASS}.ltm?later${turn}')`);
    await page.goto(`${line.origin}/picture?${turn}`, { waitUntil: 'load' });
    const png = await page.evaluate(
      () =>
        /** @type {PerformanceNavigationTiming} */ (performance.getEntriesByType('navigation')[0])
          .loadEventStart,
    );
    await page.close();
    if (turn === 0) continue;
    const all = {
      navigation_first: Number(first),
      navigation_whole: Number(whole),
      src_first: Number(later.first),
      src_whole: Number(later.whole),
      png,
    };
    for (const [name, ms] of Object.entries(all)) times[name]?.push(ms);
    console.error(
      `${turn}: ${Object.entries(all)
        .map(([name, ms]) => `${name} ${ms.toFixed(0)} ms`)
        .join(', ')}`,
    );
  }
} finally {
  await browser.close();
  line.close();
  await server.close();
}

const ms = Object.fromEntries(Object.entries(times).map(([name, all]) => [name, median(all)]));
const bytes = statSync(join(photos, `${GLASS}.ltm`)).size;
const pngBytes = statSync(join(photos, `${GLASS}-flood.png`)).size;
console.log(
  `\n10 Mbit/s, 50 ms, scripts and modules cached; ${GLASS}.ltm of ${(bytes / 1e6).toFixed(2)} MB; medians of ${TURNS}\n\n` +
    `first relit picture: ${ms['navigation_first']?.toFixed(0)} ms after navigation, ${ms['src_first']?.toFixed(0)} ms after src\n` +
    `whole photograph:    ${ms['navigation_whole']?.toFixed(0)} ms after navigation, ${ms['src_whole']?.toFixed(0)} ms after src\n` +
    `a PNG of it, ${(pngBytes / 1e6).toFixed(2)} MB:  ${ms['png']?.toFixed(0)} ms after navigation: ` +
    `${((ms['png'] ?? 0) / (ms['navigation_first'] ?? 1)).toFixed(2)} times the first relit picture`,
);
if (report) {
  const figures = {
    first_picture_ms: ms['navigation_first'],
    first_picture_after_src_ms: ms['src_first'],
    whole_photograph_ms: ms['navigation_whole'],
    png_vs_first_picture: (ms['png'] ?? 0) / (ms['navigation_first'] ?? 1),
  };
  writeFileSync(report, `${JSON.stringify({ figures }, null, 2)}\n`);
  console.log(`\n${report}`);
}
