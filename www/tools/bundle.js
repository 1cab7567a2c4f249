/**
 * Bundles www/src into dist:
 *
 * - relightable-photo.js: the element in one file, for script tags, with its workers and the scripts that it loads
 *   on demand;
 * - index.js, element.js, core.js, recover.js and openseadragon.js, which share chunks: for bundlers and import maps;
 * - types/, custom-elements.json, and the types of the element in JSX.
 */

import { execFileSync } from 'node:child_process';
import { createHash } from 'node:crypto';
import { copyFileSync, readdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join, relative } from 'node:path';
import { build } from 'esbuild';
import { minify } from 'terser';
import { writeIntegrity } from './integrity.js';
import { elementOf, jsxAttributes, makeManifest } from './manifest.js';
import { styles } from './styles.js';

const repository = join(import.meta.dirname, '..', '..');
const sources = join(repository, 'www/src');
const dist = join(repository, 'dist');

/** The scripts that the element loads on demand, by their sources. */
const LAZY_SCRIPTS = new Map([
  ['renderers/cpu/create-cpu-renderer', 'relightable-photo-cpu'],
  ['renderers/gpu/create-gpu-renderer', 'relightable-photo-gpu'],
  ['photo/main-thread-decoder', 'relightable-photo-decoder'],
  ['lights/image-light-entry', 'relightable-photo-sources'],
  ['input/interaction', 'relightable-photo-input'],
  ['input/minimap', 'relightable-photo-minimap'],
  ['levels/leveled-renderer', 'relightable-photo-levels'],
  ['ui/toolbar', 'relightable-photo-controls'],
  ...['fr', 'de', 'it', 'es', 'ja', 'zh', 'zh-hant'].map(
    (language) => /** @type {const} */ ([`i18n/${language}`, `relightable-photo-${language}`]),
  ),
]);

/** @type {import('esbuild').Plugin} */
const lazyScripts = {
  name: 'lazy-scripts',
  setup({ onResolve }) {
    onResolve({ filter: /^\.\.?\// }, ({ kind, path, resolveDir }) => {
      if (kind !== 'dynamic-import') return undefined;
      const source = relative(sources, join(resolveDir, path)).replace(/\.js$/, '');
      const file = LAZY_SCRIPTS.get(source);
      return file === undefined ? undefined : { path: `./${file}.js`, external: true };
    });
  },
};

/**
 * Puts the hash of each WebAssembly module into the scripts, which check what they fetch.
 *
 * @type {import('esbuild').Plugin}
 */
const wasmHashes = {
  name: 'wasm-hashes',
  setup({ onLoad }) {
    onLoad({ filter: /\/engine\/wasm-hashes\.ts$/ }, ({ path }) => {
      const source = readFileSync(path, 'utf8');
      const contents = source.replaceAll(/(?<=const (\w+) = )''/g, (_, name) => {
        const wasm = readFileSync(join(dist, `wasm/${name}_bg.wasm`));
        return `'sha256-${createHash('sha256').update(wasm).digest('base64')}'`;
      });
      return { contents, loader: 'ts' };
    });
  },
};

/** @type {import('esbuild').BuildOptions} */
const options = {
  absWorkingDir: repository,
  outdir: 'dist',
  bundle: true,
  format: 'esm',
  target: 'es2022',
  minify: true,
  // Browsers read modules as UTF-8 whatever the server says.
  charset: 'utf8',
  plugins: [styles, wasmHashes],
  sourcemap: 'linked',
  legalComments: 'none',
  logLevel: 'warning',
};

/** The scripts of wasm-bindgen stay separate files, so that a page loads only those of the modules that it uses. */
const external = ['./wasm/*'];

/**
 * Includes the scripts of wasm-bindgen in the workers: bundlers may turn these into classic workers, which cannot
 * import modules.
 *
 * @type {import('esbuild').Plugin}
 */
const inlineGlue = {
  name: 'glue',
  setup({ onResolve }) {
    onResolve({ filter: /^\.\/wasm\// }, ({ path }) => ({ path: join(dist, path) }));
  },
};

/**
 * Makes a script of the bundle smaller by what esbuild leaves: a thirtieth, after compression.
 *
 * @param {string} name in dist
 */
async function shrink(name) {
  const path = join(dist, name);
  const { code, map } = await minify(readFileSync(path, 'utf8'), {
    module: true,
    ecma: 2020,
    compress: { passes: 3 },
    sourceMap: { content: readFileSync(`${path}.map`, 'utf8'), url: `${name}.map` },
  });
  writeFileSync(path, `${code}\n`);
  writeFileSync(`${path}.map`, /** @type {string} */ (map));
}

for (const name of readdirSync(dist)) {
  if (/\.(js|js\.map|json)$/.test(name)) rmSync(join(dist, name));
}
await Promise.all([
  build({
    ...options,
    external,
    plugins: [styles, wasmHashes, lazyScripts],
    entryPoints: {
      'relightable-photo': 'www/src/index.ts',
      ...Object.fromEntries(
        [...LAZY_SCRIPTS].map(([source, file]) => [file, `www/src/${source}.ts`]),
      ),
    },
  }),
  build({
    ...options,
    plugins: [wasmHashes, inlineGlue],
    entryPoints: {
      'relightable-photo-worker': 'www/src/photo/decode-worker.ts',
      'relightable-photo-relighter': 'www/src/renderers/cpu/relight-worker.ts',
      'relightable-photo-recovery': 'www/src/recover/recovery-worker.ts',
    },
  }),
  build({
    ...options,
    external,
    splitting: true,
    // In the same folder, because chunks contain relative addresses.
    chunkNames: 'chunk-[hash]',
    entryPoints: {
      index: 'www/src/index.ts',
      element: 'www/src/element-entry.ts',
      core: 'www/src/core.ts',
      recover: 'www/src/recover.ts',
      openseadragon: 'www/src/openseadragon.ts',
    },
  }),
]);
await Promise.all(
  readdirSync(dist)
    .filter((name) => name.endsWith('.js'))
    .map(shrink),
);
// Modules with types only: some compilers keep their imports.
for (const name of ['react.js', 'jsx.js']) writeFileSync(join(dist, name), 'export {};\n');

rmSync(join(dist, 'types'), { recursive: true, force: true });
const tsc = createRequire(import.meta.url).resolve('typescript/package.json');
execFileSync(process.execPath, [join(tsc, '../bin/tsc'), '-p', 'tsconfig.types.json'], {
  cwd: repository,
  stdio: 'inherit',
});

const manifest = await makeManifest();
writeFileSync(join(dist, 'custom-elements.json'), `${JSON.stringify(manifest, null, 2)}\n`);
writeFileSync(join(dist, 'types/jsx-attributes.d.ts'), jsxAttributes(elementOf(manifest)));
for (const name of ['react.d.ts', 'jsx.d.ts']) {
  copyFileSync(join(repository, 'www/types', name), join(dist, 'types', name));
}
writeIntegrity();
