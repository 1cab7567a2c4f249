/**
 * How fast the player's WebAssembly decodes coefficients: node format_wasm.js FILE.ltm INSPECTED, the
 * latter what `ltm-export inspect --json` says of the file. Feeds all scans but the last, after which
 * tiles would be turned into codes, and prints {"mb_s"}: dequantised coefficients, four bytes each.
 */

import { readFileSync } from 'node:fs';
import { join } from 'node:path';

const RUNS = 5;
const wasm = join(import.meta.dirname, '../dist/wasm');
const engine = await import(join(wasm, 'relightable_photo.js'));
await engine.default({ module_or_path: readFileSync(join(wasm, 'relightable_photo_bg.wasm')) });

const [path = '', inspected = '{}'] = process.argv.slice(2);
const { scans, camera } = JSON.parse(inspected);
const last = scans.at(-2);
const bytes = readFileSync(path).subarray(0, last.prefix_bytes);
const megabytes = (camera[0] * camera[1] * last.items.end * 3 * 4) / 1e6;

let fastest = 0;
for (let run = 0; run < RUNS; run += 1) {
  const decoder = new engine.Decoder();
  const start = performance.now();
  decoder.feed(0, bytes);
  fastest = Math.max(fastest, megabytes / ((performance.now() - start) / 1000));
  decoder.free();
}
console.log(JSON.stringify({ mb_s: fastest }));
