/**
 * Writes the site as a folder of static files: node www/tools/export.js PHOTOS OUT [ADDRESS]
 * ADDRESS is the URL of the site. Only the sample of a IIIF manifest needs it, whose URLs should be absolute; without
 * it they are relative, which the site's own page can read.
 */

import { cpSync, mkdirSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import { dirname, extname, join, resolve } from 'node:path';
import { packPackage } from './package-archive.js';
import { ARCHIVE, buildPages, MANIFEST, manifestAt } from './pages.js';
import { FILES, FOLDERS } from './site.js';

const repository = join(import.meta.dirname, '..', '..');
const [photos, out, address] = process.argv.slice(2);
if (!photos || !out || (address !== undefined && !URL.canParse(address))) {
  console.error(
    'export: usage: node www/tools/export.js PHOTOS OUT [ADDRESS], where ADDRESS is the URL of the site',
  );
  process.exit(2);
}

rmSync(out, { recursive: true, force: true });
mkdirSync(out, { recursive: true });
for (const [page, content] of await buildPages()) {
  mkdirSync(dirname(join(out, page)), { recursive: true });
  writeFileSync(join(out, page), content);
}
cpSync(packPackage(), join(out, ARCHIVE));
for (const [at, folder] of Object.entries(FOLDERS)) {
  cpSync(join(repository, folder), join(out, at), {
    recursive: true,
    // Source maps and types are for development.
    filter: (path) => !path.endsWith('.map') && !path.endsWith(join('dist', 'types')),
  });
}
for (const [at, file] of Object.entries(FILES)) {
  mkdirSync(dirname(join(out, at)), { recursive: true });
  cpSync(file, join(out, at));
}
mkdirSync(join(out, 'photos'), { recursive: true });
for (const name of readdirSync(photos)) {
  if (['.ltm', '.png'].includes(extname(name)))
    cpSync(join(photos, name), join(out, 'photos', name));
}
const base = address === undefined ? '../' : new URL('.', address).href;
writeFileSync(join(out, MANIFEST), manifestAt(base));
console.log(`${resolve(out)} contains the site: upload all of it.`);
