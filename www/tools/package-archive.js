/** Packs the npm package, for the download that the site offers. */

import { execFileSync } from 'node:child_process';
import {
  existsSync,
  mkdirSync,
  mkdtempSync,
  readdirSync,
  readFileSync,
  renameSync,
  rmSync,
  statSync,
} from 'node:fs';
import { basename, join } from 'node:path';

const repository = join(import.meta.dirname, '..', '..');
const FOLDER = join(repository, 'target/package');

/** @type {{ name: string, version: string, files: string[] }} */
const { name, version, files } = JSON.parse(readFileSync(join(repository, 'package.json'), 'utf8'));
/** What the package is made from; npm adds the first two by itself. Patterns only take files away. */
const SOURCES = ['package.json', 'README.md', ...files.filter((file) => !file.startsWith('!'))];

/**
 * Packs dist and the documents, as `npm publish` would, if one of them is newer than the archive.
 *
 * @returns {string} path of the archive
 */
export function packPackage() {
  const archive = join(FOLDER, `${name}-${version}.tgz`);
  const changedAt = Math.max(...SOURCES.map((source) => lastChange(join(repository, source))));
  if (!existsSync(archive) || statSync(archive).mtimeMs <= changedAt) {
    mkdirSync(FOLDER, { recursive: true });
    // Moved when it is complete: servers of several test processes may pack and read at the same time.
    const folder = mkdtempSync(join(FOLDER, 'packing-'));
    const args = ['pack', '--ignore-scripts', '--pack-destination', folder];
    execFileSync('npm', args, { cwd: repository, stdio: ['ignore', 'ignore', 'pipe'] });
    renameSync(join(folder, basename(archive)), archive);
    rmSync(folder, { recursive: true });
  }
  return archive;
}

/** The time of the last change of a file or of anything in a folder. @param {string} path @returns {number} */
function lastChange(path) {
  const stats = statSync(path);
  if (!stats.isDirectory()) return stats.mtimeMs;
  const entries = readdirSync(path).map((entry) => lastChange(join(path, entry)));
  return Math.max(stats.mtimeMs, ...entries);
}
