/** Bundles www/src into dist/relightable-photo.js and the workers beside it, and writes the types to dist/types. */

import { execFileSync } from 'node:child_process';
import { rmSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { build } from 'esbuild';
import { styles } from './styles.js';

const repository = join(import.meta.dirname, '..', '..');

/** What is fetched only where it is asked for lies beside the element, under names of its own. */
const APART = new Map([
  ['./toolbar.js', './relightable-photo-controls.js'],
  ['./translations.js', './relightable-photo-words.js'],
]);

/** @type {import('esbuild').Plugin} */
const apart = {
  name: 'apart',
  setup({ onResolve }) {
    onResolve({ filter: /^\.\// }, ({ kind, path }) => {
      const file = kind === 'dynamic-import' ? APART.get(path) : undefined;
      return file === undefined ? undefined : { path: file, external: true };
    });
  },
};

await build({
  absWorkingDir: repository,
  entryPoints: {
    'relightable-photo': 'www/src/index.ts',
    'relightable-photo-controls': 'www/src/toolbar.ts',
    'relightable-photo-words': 'www/src/translations.ts',
    'relightable-photo-worker': 'www/src/decode-worker.ts',
    'relightable-photo-relighter': 'www/src/relight-worker.ts',
  },
  outdir: 'dist',
  bundle: true,
  format: 'esm',
  target: 'es2022',
  minify: true,
  // Modules are UTF-8 wherever they come from.
  charset: 'utf8',
  plugins: [styles, apart],
  sourcemap: 'linked',
  legalComments: 'none',
  logLevel: 'warning',
});

rmSync(join(repository, 'dist/types'), { recursive: true, force: true });
const tsc = createRequire(import.meta.url).resolve('typescript/package.json');
execFileSync(process.execPath, [join(tsc, '../bin/tsc'), '-p', 'tsconfig.types.json'], {
  cwd: repository,
  stdio: 'inherit',
});
