/** The packed package, and projects that have it installed. */

import { execFileSync } from 'node:child_process';
import { createHash } from 'node:crypto';
import {
  cpSync,
  existsSync,
  mkdirSync,
  readdirSync,
  readFileSync,
  rmSync,
  writeFileSync,
} from 'node:fs';
import { join } from 'node:path';

export const REPOSITORY = join(import.meta.dirname, '../..');
const WORK = join(REPOSITORY, 'target/package');

/** Keeps tools from sending telemetry and printing colours. */
const ENVIRONMENT = { ...process.env, NEXT_TELEMETRY_DISABLED: '1', CI: '1', NO_COLOR: '1' };

/** @param {string} folder @param {string} program @param {string[]} args */
export function run(folder, program, ...args) {
  try {
    return execFileSync(program, args, {
      cwd: folder,
      env: ENVIRONMENT,
      encoding: 'utf8',
      stdio: ['ignore', 'pipe', 'pipe'],
    });
  } catch (thrown) {
    const { stdout, stderr } = /** @type {{ stdout: string, stderr: string }} */ (thrown);
    throw new Error(`${program} ${args.join(' ')} failed in ${folder}:\n${stdout}${stderr}`);
  }
}

/**
 * @typedef {{ path: string, size: number }} PackedFile
 * @typedef {{ filename: string, size: number, unpackedSize: number, files: PackedFile[] }} Packed
 */

/** @returns {Packed & { tarball: string }} */
function pack() {
  mkdirSync(WORK, { recursive: true });
  const answer = JSON.parse(run(REPOSITORY, 'npm', 'pack', '--json', '--pack-destination', WORK));
  /** @type {Packed} */
  const packed = Array.isArray(answer) ? answer[0] : Object.values(answer)[0];
  return { ...packed, tarball: join(WORK, packed.filename) };
}

/** The tarball that `npm publish` would send. */
export const packed = pack();

/**
 * Installs the tarball as a package manager does. The package has no dependencies, so nothing is resolved and no
 * registry is asked.
 *
 * @param {string} place folder of the package
 */
function unpackInto(place) {
  rmSync(place, { recursive: true, force: true });
  mkdirSync(place, { recursive: true });
  run(place, 'tar', '-xzf', packed.tarball, '--strip-components=1');
}

/** Makes a project that has this package alone. @param {string} [name] of its folder in target/package */
export function unpacked(name = 'unpacked') {
  const folder = join(WORK, name);
  const place = join(folder, 'node_modules/relightable-photo');
  rmSync(folder, { recursive: true, force: true });
  unpackInto(place);
  // Node would otherwise resolve the name to the repository, whose package.json has the same one.
  writeFileSync(join(folder, 'package.json'), '{ "private": true }\n');
  return { folder, place };
}

/**
 * Copies a project of this folder to target/package, installs the packages of its lock file (once, until that file
 * changes), and adds this package's tarball.
 *
 * @param {string} name folder beside this file
 * @returns {string} the copy
 */
export function project(name) {
  const [source, folder] = [join(import.meta.dirname, name), join(WORK, name)];
  mkdirSync(folder, { recursive: true });
  const lock = createHash('sha256')
    .update(readFileSync(join(source, 'package-lock.json')))
    .digest('hex');
  const stamp = join(folder, 'node_modules/.lock');
  const kept = existsSync(stamp) && readFileSync(stamp, 'utf8') === lock;
  for (const entry of readdirSync(folder)) {
    if (!(kept && entry === 'node_modules')) rmSync(join(folder, entry), { recursive: true });
  }
  cpSync(source, folder, { recursive: true });
  if (!kept) {
    run(folder, 'npm', 'ci', '--no-audit', '--no-fund', '--loglevel=error');
    writeFileSync(stamp, lock);
  }
  unpackInto(join(folder, 'node_modules/relightable-photo'));
  return folder;
}

/**
 * Reads the element's declaration in the manifest of an installed package.
 *
 * @param {string} place
 * @returns {import('../../www/tools/manifest-plugin.js').Declaration}
 */
export function manifestOf(place) {
  const manifest = JSON.parse(readFileSync(join(place, 'dist/custom-elements.json'), 'utf8'));
  return manifest.modules[0].declarations.find(
    (/** @type {any} */ { customElement }) => customElement,
  );
}
