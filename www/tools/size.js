/**
 * Prints the sizes of the files that browsers load, compressed with Brotli, and exits with 1 if a limit is exceeded:
 * node www/tools/size.js [REPORT.json]
 */

import { existsSync, readFileSync, writeFileSync } from 'node:fs';
import { availableParallelism, cpus, platform } from 'node:os';
import { join } from 'node:path';
import { brotliCompressSync, constants } from 'node:zlib';

const dist = join(import.meta.dirname, '..', '..', 'dist');

/** The files of each module: its builds, of which a browser loads one, and its scripts. */
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
/** The module of recovery, which pages load only to recover, and the one that reads files for it. */
const RECOVERY = 'wasm/recovery_bg.wasm';
const CAPTURE_READER = 'wasm/capture_reader_bg.wasm';
const RECOVERY_SCRIPTS = ['recover.js', 'relightable-photo-recovery.js'];
const ELEMENT = 'relightable-photo.js';

/** Maximum sizes in kilobytes of 1000 bytes. */
const LIMITS_KB = {
  js_brotli_kb: 25,
  first_picture_wasm_brotli_kb: 110,
  all_wasm_brotli_kb: 184,
  recover_wasm_brotli_kb: 200,
};
const TITLES = {
  js_brotli_kb: 'the element',
  first_picture_wasm_brotli_kb:
    'WebAssembly for a first picture: the decoder and the largest backend',
  all_wasm_brotli_kb: 'all WebAssembly modules of the element',
  recover_wasm_brotli_kb: 'WebAssembly of recovery and the writer',
};

/** @param {string} name of a file in dist @returns {number} kilobytes */
function compressedKb(name) {
  const params = { [constants.BROTLI_PARAM_QUALITY]: constants.BROTLI_MAX_QUALITY };
  return brotliCompressSync(readFileSync(join(dist, name)), { params }).length / 1000;
}

const files = [
  ELEMENT,
  RECOVERY,
  CAPTURE_READER,
  ...RECOVERY_SCRIPTS,
  ...Object.values(MODULES).flatMap(({ builds, scripts }) => [...builds, ...scripts]),
];
const missing = files.filter((name) => !existsSync(join(dist, name)));
if (missing.length > 0) {
  console.error(`size: dist lacks ${missing.join(', ')}. Run pkg-scripts/build first.`);
  process.exit(1);
}
const sizes = Object.fromEntries(files.map((name) => [name, compressedKb(name)]));
/** @param {string} name */
const sizeOf = (name) => sizes[name] ?? 0;
/** @param {readonly number[]} kb */
const sum = (kb) => kb.reduce((all, one) => all + one, 0);
const modules = Object.values(MODULES).map(({ builds, scripts }) => ({
  wasm: Math.max(...builds.map(sizeOf)),
  scripts: sum(scripts.map(sizeOf)),
}));
const [decoder = 0, ...backends] = modules.map(({ wasm }) => wasm);
const figures = {
  js_brotli_kb: sizeOf(ELEMENT),
  first_picture_wasm_brotli_kb: decoder + Math.max(...backends),
  all_wasm_brotli_kb: sum(modules.map(({ wasm }) => wasm)),
  recover_wasm_brotli_kb: sizeOf(RECOVERY),
  capture_reader_wasm_brotli_kb: sizeOf(CAPTURE_READER),
};

for (const [name, kb] of Object.entries(sizes))
  console.log(`${kb.toFixed(1).padStart(7)} kB  ${name}`);
console.log();
for (const key of /** @type {(keyof typeof LIMITS_KB)[]} */ (Object.keys(LIMITS_KB))) {
  const [kb, limit] = [figures[key], LIMITS_KB[key]];
  const verdict = kb > limit ? 'TOO LARGE' : 'ok';
  console.log(`${kb.toFixed(1).padStart(7)} kB of ${limit} kB  ${TITLES[key]}: ${verdict}`);
  if (kb > limit) process.exitCode = 1;
}
const reader = figures.capture_reader_wasm_brotli_kb.toFixed(1).padStart(7);
console.log(`${reader} kB  WebAssembly that reads captures`);
const scripts = sum(modules.map(({ scripts }) => scripts));
console.log(`${scripts.toFixed(1).padStart(7)} kB  scripts of all modules`);

const [, , report] = process.argv;
if (report) {
  const model = cpus()[0]?.model ?? process.arch;
  const machine = `${model}, ${availableParallelism()} cores, ${platform()}`;
  writeFileSync(report, `${JSON.stringify({ figures, machine }, null, 2)}\n`);
  console.log(`\n${report}`);
}
