/** What the tests look at: a photograph recovered from the fixture, pictures of it by the native
 * program, and damaged copies. */

import { execFileSync } from 'node:child_process';
import { copyFileSync, existsSync, mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { decodePng } from '../../www/tools/pictures.js';

const repository = join(import.meta.dirname, '../..');
const program = join(repository, 'target/release/ltm-export');

export const FOLDER = join(repository, 'target/browser-tests/photos');
export const SCREENSHOTS = join(repository, 'target/screenshots');
export const LIGHTS = ['flood', 'torch', 'checkerboard', 'stripes', 'spectrum', 'fire'];

const GLASS = join(FOLDER, 'glass.ltm');
const DEMO = join(repository, 'target/demo/photos/stained-glass.ltm');

mkdirSync(FOLDER, { recursive: true });
mkdirSync(SCREENSHOTS, { recursive: true });
execFileSync(program, ['recover', 'tests/fixtures/glass-s', '-o', GLASS], {
  cwd: repository,
  stdio: ['ignore', 'ignore', 'inherit'],
});

export const glassBytes = readFileSync(GLASS);

// The demo page asks for this one; the fixture stands in for it where the demo was never made.
copyFileSync(existsSync(DEMO) ? DEMO : GLASS, join(FOLDER, 'stained-glass.ltm'));
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
 * The fixture under a light, by the native program.
 *
 * @param {string} light
 * @param {'cpu' | 'reference'} backend
 * @param {number} [exposure]
 * @param {{ x: number, y: number }} [at] where a torch shines
 */
export function nativePicture(light, backend, exposure = 1, at) {
  const out = join(FOLDER, 'native.png');
  execFileSync(program, [
    ...['relight', GLASS, '--light', light, '--backend', backend],
    ...['--exposure', String(exposure), '-o', out],
    ...(at ? ['--at', `${at.x},${at.y}`] : []),
  ]);
  return decodePng(readFileSync(out));
}
