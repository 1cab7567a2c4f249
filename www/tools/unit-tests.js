/** Compiles the tests in www/src, and runs them and those of the tools in Node. */

import { spawnSync } from 'node:child_process';
import { readdirSync, rmSync } from 'node:fs';
import { join } from 'node:path';
import { build } from 'esbuild';

const repository = join(import.meta.dirname, '..', '..');
const source = join(repository, 'www/src');
const out = join(repository, 'target/www-tests');
const tests = readdirSync(source, { recursive: true, encoding: 'utf8' }).filter((name) =>
  name.endsWith('.test.ts'),
);

rmSync(out, { recursive: true, force: true });
await build({
  entryPoints: tests.map((name) => join(source, name)),
  outdir: out,
  outbase: source,
  outExtension: { '.js': '.mjs' },
  bundle: true,
  format: 'esm',
  platform: 'node',
  external: ['./wasm/*'],
  target: 'node20',
  sourcemap: 'inline',
  logLevel: 'warning',
});

const toolTests = readdirSync(import.meta.dirname).filter((name) => name.endsWith('.test.js'));
const files = [
  ...tests.map((name) => join(out, name.replace(/\.ts$/, '.mjs'))),
  ...toolTests.map((name) => join(import.meta.dirname, name)),
];
const run = spawnSync(process.execPath, ['--enable-source-maps', '--test', ...files], {
  cwd: repository,
  stdio: 'inherit',
});
process.exitCode = run.status ?? 1;
