/** Packs the npm package, for the download that the site offers. */

import { execFileSync } from 'node:child_process';
import { mkdirSync } from 'node:fs';
import { join } from 'node:path';

const repository = join(import.meta.dirname, '..', '..');
const FOLDER = join(repository, 'target/package');

/**
 * Packs dist and the documents, as `npm publish` would.
 *
 * @returns {string} path of the archive
 */
export function packPackage() {
  mkdirSync(FOLDER, { recursive: true });
  const args = ['pack', '--json', '--ignore-scripts', '--pack-destination', FOLDER];
  const answer = JSON.parse(execFileSync('npm', args, { cwd: repository, encoding: 'utf8' }));
  /** @type {{ filename: string }} */
  const packed = Array.isArray(answer) ? answer[0] : Object.values(answer)[0];
  return join(FOLDER, packed.filename);
}
