/**
 * Measures `<relightable-photo>` in Chromium: node main.js FOLDER, where FOLDER has photographs and their description in
 * photos.json. Prints tables and writes FOLDER/figures.json. A second argument selects parts: `frames`, `peers`,
 * `memory`, `recovery`.
 *
 * A frame begins with a change by the page (`lightChanged()`, `torch`, `exposure`) and ends when the picture is
 * complete. Frames do not wait for the screen: the page's `requestAnimationFrame` is replaced. "video" sets new
 * coloured values for every light element in each frame, "torch" moves the torch, "exposure" changes the exposure under a
 * fixed torch, and "canvas" draws another 640 by 360 image to a source canvas, whose reading counts.
 *
 * For WebGPU, `onSubmittedWorkDone` reports the complete picture. For the other backends, another canvas reads one pixel of
 * the element's canvas. Each wait is checked ("waits", below): eight frames with one wait must take about eight
 * times as long as one frame with its own wait, and on graphics devices far longer than issuing them. The CPU backend has
 * two times: `handed` until `putImageData` has returned, when the element's work is done, and `done` until
 * the browser has the pixel in another canvas, which includes the browser's copies to graphics memory and back. The
 * screen is part of neither. "shown" counts frames a second with the page's own `requestAnimationFrame`, at most 60.
 *
 * Without a GPU, WebGPU and WebGL2 run on SwiftShader, a software renderer on the same cores. Such figures are marked as
 * software and say nothing about GPUs.
 *
 * The bytes of a frame are the coefficients' codes, read once, and the written picture. They are compared with the bytes that
 * two workers read and write a second with `TypedArray.set`, in the same run.
 *
 * `peers.js` is the peer: a shader that draws RTI into the visible canvas. Our element relights by any light image, the peer
 * from one direction; both draw another picture for another light.
 */

import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { memory } from './memory.js';
import { browserVersion, inPage, isSoftware, openPage, start } from './pages.js';
import { recovery } from './recovery.js';

/** @typedef {import('./hooks.js').Backend} Backend */
/** @typedef {import('./frames.js').KindName} KindName */
/** @typedef {{ name: string, side: number, rank: number, frame_bytes: number }} Photo */
/** @typedef {{ label: string, backend: Backend, workers?: number }} Way */
/** @typedef {{ issued: number[], done: number[] }} Times */

/** Number of rounds over all measurements: other load on the machine rarely lasts that long. */
const TURNS = 2;
const SECONDS = 1;
const SHOWN_SECONDS = 2;
/** The photograph for single measurements. */
const SIDE = 512;
const RANK = 16;
const SMALL = 128;
const LARGE = 2048;
const LEAST_RANK = 8;

/** @type {readonly Way[]} */
const WAYS = [
  { label: 'cpu', backend: 'cpu', workers: 2 },
  { label: 'cpu_1_worker', backend: 'cpu', workers: 1 },
  { label: 'webgl2', backend: 'webgl2' },
  { label: 'webgpu', backend: 'webgpu' },
];
const KINDS = /** @type {const} */ (['video', 'torch', 'exposure']);

const [folder = '', only = 'frames,peers,memory,recovery'] = process.argv.slice(2);
const parts = new Set(only.split(','));
/** @type {Photo[]} */
const photos = JSON.parse(readFileSync(join(folder, 'photos.json'), 'utf8'));
/** @type {Record<string, number>} */
const figures = {};
/** Milliseconds by photograph, backend and kind of frame. @type {Map<string, Times>} */
const times = new Map();
/** The graphics adapter by backend. @type {Map<string, string>} */
const adapters = new Map();
/** Reasons for missing measurements. @type {Map<string, string>} */
const failures = new Map();

/** @param {Photo} photo */
const nameOf = ({ side, rank }) => `${side}_r${rank}`;
/** @param {Photo} photo */
const addressOf = ({ name }) => `/photos/${name}`;
/** @param {number} side @param {number} rank */
function photoOf(side, rank) {
  const photo = photos.find((photo) => photo.side === side && photo.rank === rank);
  if (!photo) throw new Error(`there is no photograph of ${side} pixels and rank ${rank}`);
  return photo;
}
const software = (/** @type {string} */ label) => isSoftware(adapters.get(label) ?? '');
const marked = (/** @type {string} */ label) => (software(label) ? `${label}, software` : label);

/** Software renderers need minutes for such a frame. @param {Photo} photo @param {string} label */
const tooSlow = ({ side }, label) => side > SIDE && software(label);
const LEFT_OUT = 'left out: a program needs minutes for a frame';

/** @param {number[]} values */
const median = (values) => values.toSorted((a, b) => a - b)[values.length >> 1] ?? Number.NaN;
const fastest = (/** @type {number[]} */ values) => Math.min(...values);
/** @param {number} value @param {number} digits */
const cell = (value, digits = 2) => value.toFixed(digits).padStart(9);

const began = performance.now();
/** Reports progress. @param {string} what */
const progress = (what) =>
  console.error(`${((performance.now() - began) / 1000).toFixed(0)} s: ${what}`);

/** @param {string} key @param {Times} more */
function keep(key, { issued, done }) {
  const all = times.get(key) ?? { issued: [], done: [] };
  times.set(key, { issued: [...all.issued, ...issued], done: [...all.done, ...done] });
}

/** Measures the frames of a photograph on one backend. @param {Photo} photo @param {Way} way */
async function measure(photo, { label, backend, workers }) {
  const page = await openPage(workers ? { workers } : {});
  const name = nameOf(photo);
  try {
    const mounted = performance.now();
    const kernel = await inPage(
      page,
      async ({ frames }, { src, backend }) => (await frames.mount(src, backend)).kernel ?? '',
      { src: addressOf(photo), backend },
    );
    adapters.set(label, kernel);
    progress(
      `${name} ${label}: shown after ${((performance.now() - mounted) / 1000).toFixed(1)} s`,
    );
    const single = photo.side === SIDE && photo.rank === RANK;
    const kinds = tooSlow(photo, label) ? [] : single ? [...KINDS, 'canvas'] : KINDS;
    if (kinds.length === 0) failures.set(`${name} ${label}`, LEFT_OUT);
    for (const kind of kinds) {
      const all = await inPage(
        page,
        ({ frames }, { kind, seconds }) => {
          const photo = document.querySelector('relightable-photo');
          if (!photo) throw new Error('the element is gone');
          return frames.time(photo, /** @type {KindName} */ (kind), seconds);
        },
        { kind, seconds: SECONDS },
      );
      keep(`${name} ${label} ${kind}`, all);
      progress(`${name} ${label} ${kind}: ${short(all.done)}, issued in ${short(all.issued)}`);
    }
  } catch (error) {
    failures.set(
      `${name} ${label}`,
      String(error)
        .split('\n')[0]
        ?.replace(/^.*Error: /, '') ?? '',
    );
  }
  await page.context().close();
}

/** @param {number} copied bytes a second */
function showFrames(copied) {
  console.log(
    `\nWindow 15, two camera pixels a light element. Milliseconds until the picture is there, median and\n` +
      'fastest; frames a second by the median of video. "handed" is until the picture of video is in the\n' +
      'canvas. The share of the copy bandwidth is of the fastest frame of video, when handed on the CPU.\n',
  );
  const head = [
    'video',
    'fastest',
    'torch',
    'fastest',
    'exposure',
    'fastest',
    'handed',
    'fps',
    'of copy',
  ];
  console.log(`${''.padEnd(36)}${head.map((text) => text.padStart(9)).join('')}`);
  for (const photo of photos) {
    for (const { label, backend } of WAYS) {
      const name = nameOf(photo);
      const row = `${String(photo.side).padStart(4)}² rank ${String(photo.rank).padStart(2)}, ${marked(label)}`;
      const failure = failures.get(`${name} ${label}`);
      if (failure) console.log(`${row.padEnd(36)} ${failure}`);
      const video = times.get(`${name} ${label} video`);
      if (!video) continue;
      const cells = KINDS.map((kind) => {
        const { issued, done } = /** @type {Times} */ (times.get(`${name} ${label} ${kind}`));
        const key = `${label}_${name}_${kind}`;
        figures[`${key}_ms`] = median(done);
        figures[`${key}_fastest_ms`] = fastest(done);
        if (backend === 'cpu') figures[`${key}_handed_ms`] = median(issued);
        return cell(median(done)) + cell(fastest(done));
      });
      const handed = backend === 'cpu' ? cell(median(video.issued)) : ''.padStart(9);
      const ms = fastest(backend === 'cpu' ? video.issued : video.done);
      const share = photo.frame_bytes / (ms / 1000) / copied;
      figures[`${label}_${name}_copy_fraction`] = share;
      const fps = cell(1000 / median(video.done), 1);
      console.log(row.padEnd(36) + cells.join('') + handed + fps + cell(share, 3));
    }
  }
  for (const { label } of WAYS) {
    const canvas = times.get(`${SIDE}_r${RANK} ${label} canvas`);
    if (!canvas) continue;
    figures[`${label}_${SIDE}_r${RANK}_canvas_ms`] = median(canvas.done);
    console.log(
      `a canvas as the light, ${SIDE}² rank ${RANK}, ${marked(label)}: ${short(canvas.done)}`,
    );
  }
}

/** @param {number[]} values */
const short = (values) => `${median(values).toFixed(2)} ms, fastest ${fastest(values).toFixed(2)}`;

/** Checks that waiting for a picture really waits. */
async function checkWaits() {
  console.log('\nWaits, video: medians in milliseconds of a frame\n');
  const texts = ['issued', 'done', 'of eight', 'the wait'];
  console.log(`${''.padEnd(36)}${texts.map((text) => text.padStart(9)).join('')}`);
  for (const { label, backend, workers } of WAYS) {
    const photo = software(label) ? photoOf(SMALL, LEAST_RANK) : photoOf(SIDE, RANK);
    const page = await openPage(workers ? { workers } : {});
    const measured = await inPage(
      page,
      async ({ frames }, { src, backend }) => {
        const photo = await frames.mount(src, backend);
        const single = await frames.time(photo, 'video', 1);
        const together = await frames.timeTogether(photo, 'video', 8);
        return { ...single, together, idle: await frames.timeWaiting(photo) };
      },
      { src: addressOf(photo), backend },
    );
    await page.context().close();
    const { issued, done, together, idle } = measured;
    console.log(
      `${photo.side}² rank ${photo.rank}, ${marked(label)}`.padEnd(36) +
        [issued, done, together, idle].map((t) => cell(median(t))).join(''),
    );
  }
}

/** Measures elements as pages use them: frames on the screen, no frames without a change, the default backend. */
async function showOnScreen() {
  console.log(
    '\nShown, with the page asking for frames 60 times a second; unasked: frames in a second in',
  );
  console.log('which nothing changes\n');
  for (const photo of photos.filter((photo) => photo.rank === RANK)) {
    for (const { label, backend, workers } of WAYS) {
      if (tooSlow(photo, label)) continue;
      const page = await openPage(workers ? { workers } : {});
      const shown = await inPage(
        page,
        async ({ frames }, { src, backend, seconds }) => {
          const photo = await frames.mount(src, backend);
          const torch = await frames.showFor(photo, 'torch', seconds);
          const video = await frames.showFor(photo, 'video', seconds);
          await new Promise((resolve) => setTimeout(resolve, 500));
          return { torch, video, unasked: await frames.unasked(1) };
        },
        { src: addressOf(photo), backend, seconds: SHOWN_SECONDS },
      );
      await page.context().close();
      const name = `${label}_${nameOf(photo)}`;
      figures[`${name}_torch_shown_fps`] = shown.torch;
      figures[`${name}_video_shown_fps`] = shown.video;
      figures[`${name}_unasked_frames`] = shown.unasked;
      console.log(
        `${photo.side}² rank ${photo.rank}, ${marked(label)}`.padEnd(36) +
          `torch ${shown.torch.toFixed(1)}/s, video ${shown.video.toFixed(1)}/s, unasked ${shown.unasked}`,
      );
    }
  }
}

/** Reports the backend that elements choose by default. */
async function showDefault() {
  const page = await openPage({});
  const chosen = await inPage(
    page,
    async ({ frames }, src) => {
      const { activeBackend, kernel } = await frames.mount(src, null);
      return { backend: activeBackend ?? '', kernel };
    },
    addressOf(photoOf(SIDE, RANK)),
  );
  await page.context().close();
  const ways = WAYS.filter(
    ({ label, backend }) => label === backend && times.has(`${SIDE}_r${RANK} ${label} torch`),
  );
  const of = (/** @type {string} */ label, /** @type {KindName} */ kind) =>
    median(times.get(`${SIDE}_r${RANK} ${label} ${kind}`)?.done ?? []);
  const words = /** @type {const} */ (['video', 'torch']).map((kind) => {
    const best = ways.toSorted((a, b) => of(a.label, kind) - of(b.label, kind))[0]?.label ?? '';
    const ratio = of(chosen.backend, kind) / of(best, kind);
    figures[`default_over_fastest_${kind}`] = ratio;
    return `${kind}: the fastest is ${best}, the default takes ${ratio.toFixed(2)} times as long`;
  });
  console.log(
    `\nDefault back end here: ${chosen.backend} (${chosen.kernel}). ${words.join('; ')}.`,
  );
}

async function measurePeers() {
  for (const side of new Set(photos.map((photo) => photo.side))) {
    for (const backend of /** @type {const} */ (['webgl2', 'webgpu'])) {
      const page = await openPage({});
      const { adapter, done } = await inPage(
        page,
        ({ peers }, { backend, side, seconds }) => peers.timePeer(backend, side, seconds),
        { backend, side, seconds: SECONDS },
      );
      await page.context().close();
      adapters.set(`peer ${backend}`, adapter);
      keep(`${side} peer ${backend}`, { issued: [], done });
    }
  }
}

function showPeers() {
  console.log(
    '\nA shader of nine coefficients a channel, as viewers of RTI have it, from one direction a',
  );
  console.log('frame: its milliseconds, and its time divided by ours of a torch\n');
  for (const side of new Set(photos.map((photo) => photo.side))) {
    for (const backend of ['webgl2', 'webgpu']) {
      const peer = median(times.get(`${side} peer ${backend}`)?.done ?? []);
      figures[`peer_${backend}_${side}_ms`] = peer;
      const name = software(`peer ${backend}`) ? `${backend}, software` : backend;
      const ratios = photos
        .filter((photo) => photo.side === side)
        .flatMap(({ rank }) =>
          WAYS.filter((way) => way.backend === backend || way.label === 'cpu').flatMap(
            ({ label }) => {
              const ours = times.get(`${side}_r${rank} ${label} torch`);
              if (!ours) return [];
              const ratio = peer / median(ours.done);
              figures[`peer_${backend}_vs_${label}_${side}_r${rank}`] = ratio;
              return [`${label} rank ${rank}: ${ratio.toFixed(2)}`];
            },
          ),
        );
      console.log(`${`${side}², ${name}`.padEnd(26)}${cell(peer)}   ${ratios.join(', ')}`);
    }
  }
}

/** @param {number} workers */
async function copyBandwidth(workers) {
  const page = await openPage({});
  const copied = await inPage(page, ({ copying }, count) => copying.copyBandwidth(count), workers);
  await page.context().close();
  return copied;
}

const stop = await start(folder);
try {
  console.log(`Chromium ${browserVersion()}`);
  let copied = await copyBandwidth(2);
  for (let turn = 0; turn < TURNS; turn += 1) {
    for (const photo of parts.has('frames') ? photos : []) {
      for (const way of WAYS) {
        if (turn === 0 || !software(way.label)) await measure(photo, way);
      }
    }
    if (parts.has('peers')) await measurePeers();
  }
  copied = Math.max(copied, await copyBandwidth(2));
  figures['copy_bandwidth_gb_s'] = copied / 1e9;
  for (const [name, adapter] of adapters) {
    console.log(
      `${name}: ${adapter}${isSoftware(adapter) ? ' — software, no graphics processor' : ''}`,
    );
  }
  console.log(`copying with two workers: ${(copied / 1e9).toFixed(1)} GB/s read and written`);
  if (parts.has('frames')) {
    showFrames(copied);
    await checkWaits();
    await showOnScreen();
    await showDefault();
  }
  if (parts.has('peers')) showPeers();
  if (parts.has('memory')) {
    const held = [SIDE, LARGE].map((side) => photoOf(side, RANK));
    const photos = held.map((photo) => ({ name: nameOf(photo), src: addressOf(photo) }));
    Object.assign(figures, await memory(addressOf(photoOf(SMALL, LEAST_RANK)), photos));
  }
  if (parts.has('recovery')) Object.assign(figures, await recovery(folder));
  writeFileSync(join(folder, 'figures.json'), JSON.stringify(figures));
} finally {
  await stop();
}
