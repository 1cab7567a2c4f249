/**
 * Test data: photographs recovered from the fixture and from a tall scene, damaged copies of them, and pictures drawn
 * by ltm-export to compare with. `makeTestPhotos` writes the files once per run; the other functions read them.
 */

import { execFileSync } from 'node:child_process';
import { createHash } from 'node:crypto';
import { copyFileSync, existsSync, mkdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { decodePng, encodePng } from '../../www/tools/pictures.js';

/** @typedef {import('../../www/tools/pictures.js').Picture} Picture */

const repository = join(import.meta.dirname, '../..');
const program = join(repository, 'target/release/ltm-export');

/** Folder of the photographs that the test server serves. */
export const FOLDER = join(repository, 'target/browser-tests/photos');
export const LIGHTS = ['flood', 'torch', 'checkerboard', 'stripes', 'spectrum', 'fire'];

const GLASS = join(FOLDER, 'glass.ltm');
export const TALL_FILE = join(FOLDER, 'tall.ltm');
/** 523 x 41 pixels in three levels: shards of 256 pixels, and a root of 131 x 11. */
export const LEVELS_FILE = join(FOLDER, 'levels.ltm');
/** The tall photograph has one tile in each row of tiles, so up to four workers share it. */
export const TALL_TILE_ROWS = 4;
const TILE_SIDE_PX = 128;
/** As of a camera whose channels overlap. */
const TALL_COLOR_MATRIX = [
  [1.9, -0.7, -0.2],
  [-0.2, 1.5, -0.3],
  [0, -0.6, 1.6],
];
const DEMO = join(repository, 'target/demo/photos');

/** A light image whose size does not divide the light plane: patches of colour, with grain. @type {Picture} */
const LIGHT_IMAGE = {
  width: 150,
  height: 91,
  data: Uint8Array.from({ length: 150 * 91 * 4 }, (_, i) => {
    const [x, y, c] = [(i >> 2) % 150, Math.floor((i >> 2) / 150), i % 4];
    if (c === 3) return 255;
    const patch = (Math.floor(x / 19) * 5 + Math.floor(y / 13) * 3 + c * 2) % 7;
    return patch * 36 + ((i * 7919) % 40);
  }),
};
export const LIGHT_IMAGE_FILE = join(FOLDER, 'light.png');
export const LIGHT_IMAGE_URL = `data:image/png;base64,${encodePng(LIGHT_IMAGE).toString('base64')}`;

/** Damaged copies of the fixture's photograph, with the error code that each must produce. */
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

/** Writes all test photographs, unless this build of ltm-export has written them before. */
export function makeTestPhotos() {
  const build = createHash('sha256')
    .update(readFileSync(program))
    .update(readFileSync(import.meta.filename))
    .update(readFileSync('tests/fixtures/glass-s/capture.json'))
    .update(readFileSync('tests/fixtures/format/levels.ltm'))
    .digest('hex');
  const stamp = join(FOLDER, '../made-by');
  if (!existsSync(stamp) || readFileSync(stamp, 'utf8') !== build) {
    rmSync(FOLDER, { recursive: true, force: true });
    mkdirSync(FOLDER, { recursive: true });
    run('recover', 'tests/fixtures/glass-s', '-o', GLASS);
    makeTallPhoto();
    copyFileSync('tests/fixtures/format/levels.ltm', LEVELS_FILE);
    writeDamagedCopies();
    writeFileSync(LIGHT_IMAGE_FILE, encodePng(LIGHT_IMAGE));
    writeFileSync(stamp, build);
  }
  copyDemoPhotos();
}

/** @param {string[]} args */
function run(...args) {
  execFileSync(program, args, { cwd: repository, stdio: ['ignore', 'ignore', 'inherit'] });
}

function makeTallPhoto() {
  const capture = join(FOLDER, '../tall-capture');
  rmSync(capture, { recursive: true, force: true });
  const camera = `${TILE_SIDE_PX}x${TILE_SIDE_PX * TALL_TILE_ROWS}`;
  const size = ['--camera', camera, '--light', '128x128', '--patterns', '30', '--seed', '1'];
  run('simulate', 'stained-glass', ...size, '-o', capture);
  const manifest = join(capture, 'capture.json');
  const fields = JSON.parse(readFileSync(manifest, 'utf8'));
  fields.camera.color_matrix = TALL_COLOR_MATRIX;
  writeFileSync(manifest, JSON.stringify(fields));
  run('recover', capture, '--window', '5', '-o', TALL_FILE);
}

/** Copies the photographs that the site shows. The fixture replaces those of which no demo was made. */
function copyDemoPhotos() {
  for (const scene of ['stained-glass', 'cookies']) {
    const demo = join(DEMO, `${scene}.ltm`);
    copyFileSync(existsSync(demo) ? demo : GLASS, join(FOLDER, `${scene}.ltm`));
    for (const light of ['flood', 'torch', 'fire', 'stripes', 'spectrum']) {
      const still = join(DEMO, `${scene}-${light}.png`);
      const copy = join(FOLDER, `${scene}-${light}.png`);
      if (existsSync(still)) copyFileSync(still, copy);
      else run('relight', GLASS, '--light', light, '-o', copy);
    }
  }
}

function writeDamagedCopies() {
  /** @type {Record<keyof typeof DAMAGED, (bytes: Buffer) => Buffer>} */
  const damages = {
    'truncated.ltm': (bytes) => bytes.subarray(0, bytes.length / 2),
    'empty.ltm': () => Buffer.alloc(0),
    'too-long.ltm': (bytes) => Buffer.concat([bytes, Buffer.from('more')]),
    'flipped-header.ltm': (bytes) => flipBit(bytes, 20),
    'flipped-tile.ltm': (bytes) => flipBit(bytes, bytes.length - 10),
    'unknown-version.ltm': (bytes) => {
      bytes.writeUInt16LE(9, 12);
      return bytes;
    },
    'text-mode.ltm': (bytes) =>
      Buffer.from(bytes.toString('latin1').replaceAll('\r\n', '\n'), 'latin1'),
    'not-ltm.ltm': () => Buffer.from('{"error": "no such photograph"}'),
  };
  for (const [name, damage] of Object.entries(damages)) {
    writeFileSync(join(FOLDER, name), damage(readFileSync(GLASS)));
  }
}

/** @param {Buffer} bytes @param {number} at */
function flipBit(bytes, at) {
  bytes[at] = (bytes[at] ?? 0) ^ 1;
  return bytes;
}

/** @type {Map<string, Buffer>} */
const files = new Map();

/** @param {string} name */
function fileBytes(name) {
  const bytes = files.get(name) ?? readFileSync(join(FOLDER, name));
  files.set(name, bytes);
  return bytes;
}

/** The photograph that most tests show: 64 × 64 camera pixels, one tile. */
export const glassBytes = () => fileBytes('glass.ltm');
/**
 * Hash of a file without the origin in its metadata, which the command line alone writes, and without the lengths and checksums
 * that depend on it (docs/format.md, section 3.1).
 *
 * @param {Buffer} bytes
 */
export function contentHash(bytes) {
  const header = Buffer.from(bytes.subarray(0, 144));
  const metadataStart = 144 + header.readUInt32LE(104) + header.readUInt32LE(112);
  const metadataEnd = metadataStart + header.readUInt32LE(120);
  const metadata = JSON.parse(bytes.subarray(metadataStart, metadataEnd).toString());
  delete metadata.origin;
  for (const [start, end] of /** @type {const} */ ([
    [88, 96],
    [120, 128],
    [140, 144],
  ])) {
    header.fill(0, start, end);
  }
  return createHash('sha256')
    .update(header)
    .update(bytes.subarray(144, metadataStart))
    .update(JSON.stringify(metadata))
    .update(bytes.subarray(metadataEnd))
    .digest('hex');
}
/** The photograph that the gallery shows first. */
export const demoBytes = () => fileBytes('stained-glass.ltm');

/** @type {Map<string, Picture>} */
const pictures = new Map();

/**
 * Draws a photograph with ltm-export.
 *
 * @param {string} light a built-in light's name, or the file of a light image
 * @param {object} [options]
 * @param {'cpu' | 'reference'} [options.backend]
 * @param {number} [options.exposure]
 * @param {{ x: number, y: number }} [options.torch] position of the torch
 * @param {string} [options.photo] its file; the fixture's photograph by default
 */
export function nativePicture(light, options = {}) {
  const { backend = 'reference', exposure = 1, torch, photo = GLASS } = options;
  const args = [
    ...['relight', photo, '--light', light, '--backend', backend],
    ...['--exposure', String(exposure)],
    ...(torch ? ['--at', `${torch.x},${torch.y}`] : []),
  ];
  const key = args.join(' ');
  let picture = pictures.get(key);
  if (!picture) {
    // Test workers are processes of their own and must not share the file.
    const out = join(FOLDER, `native-${process.pid}.png`);
    execFileSync(program, [...args, '-o', out], { stdio: ['ignore', 'ignore', 'inherit'] });
    picture = decodePng(readFileSync(out));
    rmSync(out);
    pictures.set(key, picture);
  }
  return picture;
}
