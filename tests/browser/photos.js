/** What the tests look at: photographs recovered from the fixture and from a tall scene, pictures of them
 * by the native program, and damaged copies. */

import { execFileSync } from 'node:child_process';
import { createHash } from 'node:crypto';
import { copyFileSync, existsSync, mkdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { decodePng } from '../../www/tools/pictures.js';

const repository = join(import.meta.dirname, '../..');
const program = join(repository, 'target/release/ltm-export');

export const FOLDER = join(repository, 'target/browser-tests/photos');
export const SCREENSHOTS = join(repository, 'target/screenshots');
export const LIGHTS = ['flood', 'torch', 'checkerboard', 'stripes', 'spectrum', 'fire'];

const GLASS = join(FOLDER, 'glass.ltm');
export const TALL = join(FOLDER, 'tall.ltm');
/** Rows of tiles, one of them a row, for workers to share. */
export const TALL_ROWS = 4;
const DEMO = join(repository, 'target/demo/photos');

mkdirSync(FOLDER, { recursive: true });
mkdirSync(SCREENSHOTS, { recursive: true });

/** @param {string[]} args */
function run(...args) {
  execFileSync(program, args, { cwd: repository, stdio: ['ignore', 'ignore', 'inherit'] });
}

run('recover', 'tests/fixtures/glass-s', '-o', GLASS);
makeTall();

/** Tiles have 128 pixels a side. Takes a while, so made once by each build of the program. */
function makeTall() {
  const size = ['--camera', `128x${128 * TALL_ROWS}`, '--light', '128x128'];
  const simulate = ['simulate', 'stained-glass', ...size, '--patterns', '30', '--seed', '1'];
  const recover = ['--window', '5', '-o', TALL];
  const build = createHash('sha256').update(readFileSync(program)).digest('hex');
  const madeBy = [build, ...simulate, ...recover].join(' ');
  const stamp = join(FOLDER, '../tall-made-by');
  if (existsSync(TALL) && existsSync(stamp) && readFileSync(stamp, 'utf8') === madeBy) return;
  const capture = join(FOLDER, '../tall-capture');
  rmSync(capture, { recursive: true, force: true });
  run(...simulate, '-o', capture);
  run('recover', capture, ...recover);
  writeFileSync(stamp, madeBy);
}

export const glassBytes = readFileSync(GLASS);

// The site asks for these; the fixture stands in for them where the demo was never made.
for (const scene of ['stained-glass', 'cookies']) {
  const made = join(DEMO, `${scene}.ltm`);
  copyFileSync(existsSync(made) ? made : GLASS, join(FOLDER, `${scene}.ltm`));
  for (const light of ['flood', 'torch', 'fire', 'stripes', 'spectrum']) {
    const still = join(DEMO, `${scene}-${light}.png`);
    const copy = join(FOLDER, `${scene}-${light}.png`);
    if (existsSync(still)) copyFileSync(still, copy);
    else run('relight', GLASS, '--light', light, '-o', copy);
  }
}
export const demoBytes = readFileSync(join(FOLDER, 'stained-glass.ltm'));

/** Names of damaged copies, with the code each of them has to end in. */
export const DAMAGED = {
  'truncated.ltm': 'format-truncated',
  'empty.ltm': 'format-truncated',
  'too-long.ltm': 'format-invalid',
  'flipped-header.ltm': 'format-checksum',
  'flipped-tile.ltm': 'format-checksum',
  'unknown-version.ltm': 'format-version',
  'text-mode.ltm': 'format-text-mode',
  'not-ltm.ltm': 'format-magic',
};

/** @param {string} name @param {(bytes: Buffer) => Buffer} change */
function damaged(name, change) {
  writeFileSync(join(FOLDER, name), change(Buffer.from(glassBytes)));
}

/** @param {Buffer} bytes @param {number} at */
function flip(bytes, at) {
  bytes[at] = (bytes[at] ?? 0) ^ 1;
  return bytes;
}

damaged('truncated.ltm', (bytes) => bytes.subarray(0, bytes.length / 2));
damaged('empty.ltm', () => Buffer.alloc(0));
damaged('too-long.ltm', (bytes) => Buffer.concat([bytes, Buffer.from('more')]));
damaged('flipped-header.ltm', (bytes) => flip(bytes, 20));
damaged('flipped-tile.ltm', (bytes) => flip(bytes, bytes.length - 10));
damaged('unknown-version.ltm', (bytes) => {
  bytes.writeUInt16LE(9, 12);
  return bytes;
});
damaged('text-mode.ltm', (bytes) =>
  Buffer.from(bytes.toString('latin1').replaceAll('\r\n', '\n'), 'latin1'),
);
damaged('not-ltm.ltm', () => Buffer.from('{"error": "no such photograph"}'));

/**
 * A photograph under a light, by the native program.
 *
 * @param {string} light
 * @param {'cpu' | 'reference'} backend
 * @param {number} [exposure]
 * @param {{ x: number, y: number }} [at] where a torch shines
 * @param {string} [photo] its file, the fixture's where left out
 */
export function nativePicture(light, backend, exposure = 1, at, photo = GLASS) {
  const out = join(FOLDER, 'native.png');
  execFileSync(program, [
    ...['relight', photo, '--light', light, '--backend', backend],
    ...['--exposure', String(exposure), '-o', out],
    ...(at ? ['--at', `${at.x},${at.y}`] : []),
  ]);
  return decodePng(readFileSync(out));
}
