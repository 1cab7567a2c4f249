/** Hashes of the package's files, for `integrity` attributes and import maps: node www/tools/integrity.js */

import { createHash } from 'node:crypto';
import { readdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';

const dist = join(import.meta.dirname, '..', '..', 'dist');
const FILE = 'integrity.json';

/** The files that browsers load. */
const LOADED = /\.(js|wasm)$/;

/** The value of an `integrity` attribute. @param {Uint8Array} bytes */
export function integrityOf(bytes) {
  return `sha384-${createHash('sha384').update(bytes).digest('base64')}`;
}

/** Writes dist/integrity.json, which maps each file that browsers load to its hash. */
export function writeIntegrity() {
  const names = [
    ...readdirSync(dist),
    ...readdirSync(join(dist, 'wasm')).map((name) => `wasm/${name}`),
  ];
  const table = names
    .filter((name) => LOADED.test(name))
    .sort()
    .map((name) => [name, integrityOf(readFileSync(join(dist, name)))]);
  writeFileSync(join(dist, FILE), `${JSON.stringify(Object.fromEntries(table), null, 2)}\n`);
  return table;
}

if (import.meta.url === pathToFileURL(process.argv[1] ?? '').href) {
  for (const [name, hash] of writeIntegrity()) console.log(`${hash}  ${name}`);
}
