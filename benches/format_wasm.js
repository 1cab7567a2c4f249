/**
 * The speed of decoding in WebAssembly: `node format_wasm.js FILE.ltm REPORT`, with the JSON report of
 * `ltm-export inspect --json FILE.ltm`. Decodes the whole file, as the element does, and prints `{"mb_s"}`: megabytes
 * of dequantised coefficients, four bytes each, in a second.
 */

import { readFileSync } from 'node:fs';
// Static, so that the compiler of the test command sees a module that does not exist.
import initialise, { Decoder } from '../dist/wasm/decoder.js';

const RUNS = 5;
const code = readFileSync(new URL('../dist/wasm/decoder_bg.wasm', import.meta.url));
await initialise({ module_or_path: code });

const [path = '', report = '{}'] = process.argv.slice(2);
const { scans, camera } = JSON.parse(report);
const bytes = readFileSync(path);
const megabytes = (camera[0] * camera[1] * scans.at(-1).items.end * 3 * 4) / 1e6;

let fastest = 0;
for (let run = 0; run < RUNS; run += 1) {
  const decoder = new Decoder();
  const start = performance.now();
  decoder.feed(0, bytes);
  const photo = decoder.finish();
  fastest = Math.max(fastest, megabytes / ((performance.now() - start) / 1000));
  photo.free();
}
console.log(JSON.stringify({ mb_s: fastest }));
