/**
 * Weighs what browsers load, compressed by Brotli as servers send it, and exits with 1 where it is more than it
 * may be: node www/tools/size.js [REPORT.json]
 */

import { existsSync, readFileSync, writeFileSync } from 'node:fs';
import { availableParallelism, cpus, platform } from 'node:os';
import { join } from 'node:path';
import { brotliCompressSync, constants } from 'node:zlib';

const dist = join(import.meta.dirname, '..', '..', 'dist');

/** What each module takes: its code in one of its builds, and the scripts that go with it. */
const MODULES = {
  decoder: {
    builds: ['wasm/decoder_bg.wasm', 'wasm/decoder_scalar_bg.wasm'],
    scripts: ['wasm/decoder.js', 'relightable-photo-worker.js'],
  },
  cpu: {
    builds: ['wasm/cpu_bg.wasm', 'wasm/cpu_scalar_bg.wasm'],
    scripts: ['wasm/cpu.js', 'relightable-photo-cpu.js', 'relightable-photo-relighter.js'],
  },
  webgl2: {
    builds: ['wasm/webgl2_bg.wasm'],
    scripts: ['wasm/webgl2.js', 'relightable-photo-gpu.js'],
  },
  webgpu: { builds: ['wasm/webgpu_bg.wasm'], scripts: ['wasm/webgpu.js'] },
};
const ELEMENT = 'relightable-photo.js';

/** Most kilobytes, of 1000 bytes. */
const LIMITS = {
  js_brotli_kb: 25,
  first_picture_wasm_brotli_kb: 110,
  all_wasm_brotli_kb: 180,
};
const TITLES = {
  js_brotli_kb: 'the element',
  first_picture_wasm_brotli_kb:
    'WebAssembly for a first picture: the decoder and the largest back end',
  all_wasm_brotli_kb: 'all WebAssembly that a browser can need',
};

/** @param {string} name of a file in dist @returns {number} kilobytes */
function weigh(name) {
  const params = { [constants.BROTLI_PARAM_QUALITY]: constants.BROTLI_MAX_QUALITY };
  return brotliCompressSync(readFileSync(join(dist, name)), { params }).length / 1000;
}

const files = [
  ELEMENT,
  ...Object.values(MODULES).flatMap(({ builds, scripts }) => [...builds, ...scripts]),
];
const missing = files.filter((name) => !existsSync(join(dist, name)));
if (missing.length > 0) {
  console.error(`size: not in dist: ${missing.join(', ')}. Run pkg-scripts/build first.`);
  process.exit(1);
}
const weights = Object.fromEntries(files.map((name) => [name, weigh(name)]));
/** @param {string} name */
const weightOf = (name) => weights[name] ?? 0;
/** @param {readonly number[]} kb */
const sum = (kb) => kb.reduce((all, one) => all + one, 0);
const modules = Object.values(MODULES).map(({ builds, scripts }) => ({
  // A browser loads one build.
  wasm: Math.max(...builds.map(weightOf)),
  scripts: sum(scripts.map(weightOf)),
}));
const [decoder = 0, ...backends] = modules.map(({ wasm }) => wasm);
const figures = {
  js_brotli_kb: weightOf(ELEMENT),
  first_picture_wasm_brotli_kb: decoder + Math.max(...backends),
  all_wasm_brotli_kb: sum(modules.map(({ wasm }) => wasm)),
};

for (const [name, kb] of Object.entries(weights))
  console.log(`${kb.toFixed(1).padStart(7)} kB  ${name}`);
console.log();
for (const key of /** @type {(keyof typeof LIMITS)[]} */ (Object.keys(LIMITS))) {
  const [kb, limit] = [figures[key], LIMITS[key]];
  const verdict = kb > limit ? 'TOO MUCH' : 'ok';
  console.log(`${kb.toFixed(1).padStart(7)} kB of ${limit} kB  ${TITLES[key]}: ${verdict}`);
  if (kb > limit) process.exitCode = 1;
}
const scripts = sum(modules.map(({ scripts }) => scripts));
console.log(`${scripts.toFixed(1).padStart(7)} kB  scripts that go with all of these modules`);

const [, , report] = process.argv;
if (report) {
  const model = cpus()[0]?.model ?? process.arch;
  const machine = `${model}, ${availableParallelism()} cores, ${platform()}`;
  writeFileSync(report, `${JSON.stringify({ figures, machine }, null, 2)}\n`);
  console.log(`\n${report}`);
}
