/** Tests the tarball's files and its imports in Node, TypeScript and browsers. */

import assert from 'node:assert/strict';
import { existsSync, readFileSync, statSync, symlinkSync, writeFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { join, posix } from 'node:path';
import { test } from 'node:test';
import { pathToFileURL } from 'node:url';
import { PACKED_DOCUMENTS } from '../../www/tools/documents.js';
import { integrityOf } from '../../www/tools/integrity.js';
import { headingId } from '../../www/tools/markdown.js';
import { compare } from '../../www/tools/pictures.js';
import { makeTestPhotos, nativePicture, glassBytes as readGlass } from '../browser/test-photos.js';
import { manifestOf, packed, REPOSITORY, run, unpacked } from './packed.js';

makeTestPhotos();
const glassBytes = readGlass();

/** Scripts with fixed names. */
const SCRIPTS = [
  ...[
    '',
    '-controls',
    '-worker',
    '-cpu',
    '-gpu',
    '-relighter',
    '-recovery',
    '-decoder',
    '-sources',
    '-input',
    '-levels',
    '-minimap',
  ].map((part) => `relightable-photo${part}`),
  ...['fr', 'de', 'it', 'es', 'ja', 'zh', 'zh-hant'].map(
    (language) => `relightable-photo-${language}`,
  ),
  ...['index', 'element', 'core', 'recover', 'openseadragon'],
];
const CORE_MODULES = ['decoder', 'cpu'];
const MODULES = [...CORE_MODULES, 'webgl2', 'webgpu', 'recovery', 'capture_reader'];
const BUILDS = [...MODULES, 'decoder_scalar', 'cpu_scalar'];

const EXPECTED = [
  ...['package.json', 'README.md', 'LICENSE-MIT', 'LICENSE-APACHE'],
  ...PACKED_DOCUMENTS,
  ...['dist/custom-elements.json', 'dist/integrity.json', 'dist/THIRD-PARTY.md'],
  ...SCRIPTS.flatMap((name) => [`dist/${name}.js`, `dist/${name}.js.map`]),
  ...['dist/react.js', 'dist/jsx.js'],
  ...MODULES.flatMap((name) => [`dist/wasm/${name}.js`, `dist/wasm/${name}.d.ts`]),
  ...BUILDS.map((name) => `dist/wasm/${name}_bg.wasm`),
];
/** Files whose names vary: samples and figures of the documents, shared chunks, and types without those of tests. */
const ALSO = [
  /^docs\/(samples\/[\w.-]+|images\/[\w/-]+\.(svg|jpg))$/,
  /^dist\/chunk-[A-Z0-9]{8}\.js(\.map)?$/,
  /^dist\/types\/(?!.*(test|fakes))[a-z0-9/-]+\.d\.ts$/,
];

/** Of these, 1.8 MB and 0.7 MB are for recovery: its module, its scripts, and the reader of zip files. */
const MAX_UNPACKED_BYTES = 5_300_000;
const MAX_PACKED_BYTES = 1_900_000;
const MAX_MAP_BYTES = 500_000;

const { folder, place } = unpacked('imported');
/** @type {{ exports: Record<string, string | { types: string, default: string }>, customElements: string }} */
const packageJson = JSON.parse(readFileSync(join(place, 'package.json'), 'utf8'));

/** @param {string} file */
const at = (file) => pathToFileURL(join(place, file)).href;

test('the tarball has exactly the expected files', () => {
  const paths = packed.files.map(({ path }) => path);
  const missing = EXPECTED.filter((path) => !paths.includes(path));
  const more = paths.filter(
    (path) => !EXPECTED.includes(path) && !ALSO.some((pattern) => pattern.test(path)),
  );
  assert.deepEqual({ missing, more }, { missing: [], more: [] });
  assert.ok(packed.unpackedSize <= MAX_UNPACKED_BYTES, `${packed.unpackedSize} bytes unpacked`);
  assert.ok(packed.size <= MAX_PACKED_BYTES, `${packed.size} bytes packed`);
  for (const { path, size } of packed.files) {
    if (path.endsWith('.map')) assert.ok(size <= MAX_MAP_BYTES, `${path} has ${size} bytes`);
  }
});

test('the documents are complete, and their links lead to files and headings of the tarball', () => {
  const texts = new Map(
    packed.files
      .filter(({ path }) => /^[^/]*\.md$|^docs\/.*\.md$/.test(path))
      .map(({ path }) => [path, readFileSync(join(place, path), 'utf8')]),
  );
  assert.deepEqual([...texts.keys()].sort(), ['README.md', ...PACKED_DOCUMENTS].sort());
  const broken = [];
  let links = 0;
  for (const [path, text] of texts) {
    // Code may contain brackets.
    const prose = text.replaceAll(/^```.*?^```/gms, '').replaceAll(/`[^`\n]*`/g, '');
    for (const [, reference = ''] of prose.matchAll(/\]\(([^)\s]+)\)/g)) {
      if (/^https?:/.test(reference)) continue;
      links += 1;
      const [file = '', hash] = reference.split('#');
      const target = file ? posix.join(posix.dirname(path), file) : path;
      const exists = existsSync(join(place, target));
      const has = hash === undefined || headingsOf(texts.get(target) ?? '').includes(hash);
      if (!exists || !has) broken.push(`${path}: ${reference}`);
    }
  }
  assert.deepEqual(broken, []);
  assert.ok(links >= 80, `${links} links`);
});

/** The ids of a document's headings. @param {string} text */
function headingsOf(text) {
  const used = new Map();
  return [...text.replaceAll(/^```.*?^```/gms, '').matchAll(/^#{1,6} (.*)$/gm)].map(
    ([, heading = '']) =>
      headingId(heading.replaceAll(/\[([^\]]*)\]\([^)]*\)/g, '$1').replaceAll(/[`*]/g, ''), used),
  );
}

test('the licences of compiled crates are included', () => {
  const text = readFileSync(join(place, 'dist/THIRD-PARTY.md'), 'utf8');
  for (const crate of ['zstd-sys', 'serde', 'web-sys', 'wasm-bindgen']) {
    assert.match(text, new RegExp(`^- ${crate} \\d`, 'm'));
  }
  // zstd's own, and that of the crate around it.
  assert.match(text, /Meta Platforms, Inc/);
  assert.match(text, /Redistribution and use in source and binary forms/);
});

test('every export exists and can be imported in Node', () => {
  const names = Object.keys(packageJson.exports).filter((name) => !name.includes('*'));
  for (const [name, target] of Object.entries(packageJson.exports)) {
    const files = typeof target === 'string' ? [target] : Object.values(target);
    for (const file of files) {
      assert.ok(
        existsSync(join(place, file.replace('/*', ''))),
        `${name} names the missing file ${file}`,
      );
    }
  }
  assert.ok(existsSync(join(place, packageJson.customElements)));
  const wasm = [...MODULES.map((name) => `${name}.js`), ...BUILDS.map((name) => `${name}_bg.wasm`)];
  const script = `
    const before = Object.getOwnPropertyNames(globalThis);
    for (const name of ${JSON.stringify(names)}) {
      const specifier = 'relightable-photo' + name.slice(1);
      if (name.endsWith('.json')) await import(specifier, { with: { type: 'json' } });
      else await import(specifier);
    }
    for (const name of ${JSON.stringify(wasm)}) {
      const url = import.meta.resolve('relightable-photo/wasm/' + name);
      if (!(await import('node:fs')).existsSync(new URL(url))) throw new Error(url);
      if (name.endsWith('.js')) await import(url);
    }
    const { RelightablePhotoElement, PhotoError } = await import('relightable-photo');
    const element = await import('relightable-photo/element');
    const core = await import('relightable-photo/core');
    if (RelightablePhotoElement !== element.RelightablePhotoElement) throw new Error('there are two classes');
    if (PhotoError !== core.PhotoError) throw new Error('there are two errors');
    element.defineRelightablePhoto();
    const added = Object.getOwnPropertyNames(globalThis).filter((name) => !before.includes(name));
    if (added.length > 0) throw new Error('there are new globals: ' + added);
    console.log('imported');
  `;
  writeFileSync(join(folder, 'server.mjs'), script);
  // Every warning is an error.
  const options = [
    '--throw-deprecation',
    '--no-experimental-require-module',
    '--disable-warning=ExperimentalWarning',
  ];
  assert.equal(run(folder, process.execPath, ...options, 'server.mjs'), 'imported\n');
});

test('importing the class defines no element, importing the package does', () => {
  const script = (/** @type {string} */ specifier) => `
    const defined = [];
    globalThis.HTMLElement = class {};
    globalThis.customElements = { get: (name) => undefined, define: (name) => defined.push(name) };
    await import('${specifier}');
    console.log(JSON.stringify(defined));
  `;
  for (const [specifier, defined] of [
    ['relightable-photo/element', []],
    ['relightable-photo/core', []],
    ['relightable-photo/recover', []],
    ['relightable-photo', ['relightable-photo']],
    ['relightable-photo/script', ['relightable-photo']],
  ]) {
    writeFileSync(join(folder, 'defines.mjs'), script(String(specifier)));
    const said = JSON.parse(run(folder, process.execPath, 'defines.mjs'));
    assert.deepEqual(said, defined, String(specifier));
  }
});

test('integrity.json has the hash of every script and module', () => {
  /** @type {Record<string, string>} */
  const table = JSON.parse(readFileSync(join(place, 'dist/integrity.json'), 'utf8'));
  const loaded = packed.files
    .map(({ path }) => path)
    .filter((path) => /^dist\/.*\.(js|wasm)$/.test(path));
  assert.deepEqual(
    Object.keys(table).sort(),
    loaded.map((path) => path.slice('dist/'.length)).sort(),
  );
  for (const [name, hash] of Object.entries(table)) {
    assert.equal(integrityOf(readFileSync(join(place, 'dist', name))), hash, name);
  }
});

test('scripts need nothing that the content security policy forbids', () => {
  for (const { path } of packed.files) {
    if (!/^dist\/.*\.js$/.test(path)) continue;
    const text = readFileSync(join(place, path), 'utf8');
    assert.doesNotMatch(
      text,
      /\beval\(|new Function\(|createObjectURL|https?:\/\/(?!www\.w3\.org)/,
      path,
    );
  }
});

test('types resolve under every moduleResolution', () => {
  const uses = `
    import { type PhotoInfo, RelightablePhotoElement, type RelightablePhotoEventMap } from 'relightable-photo';
    import { defineRelightablePhoto, PhotoError } from 'relightable-photo/element';
    import type { RelitPicture } from 'relightable-photo/core';
    import { openCaptureFolder, type PhotographInput, recover } from 'relightable-photo/recover';
    import 'relightable-photo/script';
    import type { RelightablePhotoProps } from 'relightable-photo/jsx';
    const photo = document.querySelector('relightable-photo');
    photo?.addEventListener('error', ({ code }) => code.length);
    export const info: PhotoInfo | null = photo instanceof RelightablePhotoElement ? photo.info : null;
    export const props: RelightablePhotoProps = { src: '/window.ltm', exposure: 1 };
    export type { RelitPicture, RelightablePhotoEventMap };
    export { defineRelightablePhoto, PhotoError };
    export async function show(zip: Blob, photographs: PhotographInput[]): Promise<Blob> {
      const recovered = await recover({ folder: await openCaptureFolder(zip) }, { window: 'auto' });
      if (photo) photo.photograph = recovered;
      const light = { data: new Float32Array(4), width: 2, height: 2 };
      await recovered.evaluate(photographs.map((photograph) => ({ light, photograph })));
      return recovered.toBlob({ snr: 30 });
    }
    // @ts-expect-error: there is no such property
    photo?.nothing;
  `;
  const core = `
    import { decode, type Light, PhotoError, provideWasm, relight } from 'relightable-photo/core';
    const lights: Light[] = ['fire', { x: 0, y: 1 }, { data: new Float32Array(3), width: 1, height: 1 }];
    export async function draw(bytes: Uint8Array): Promise<Uint8ClampedArray> {
      const photo = await decode(bytes, { signal: AbortSignal.timeout(1000) });
      try {
        return (await relight(photo, lights[0], { exposure: 2, tone: 'filmic' })).pixels;
      } finally {
        photo.free();
      }
    }
    // @ts-expect-error: there is no such light
    export const wrong: Light = 'moon';
    export { PhotoError, provideWasm };
  `;
  writeFileSync(join(folder, 'uses.mts'), uses);
  writeFileSync(join(folder, 'core.mts'), core);
  // CommonJS can import types only, without import().
  writeFileSync(
    join(folder, 'uses.cts'),
    `export type Photo = import('relightable-photo', { with: { 'resolution-mode': 'import' } }).RelightablePhotoElement;`,
  );
  const types = join(folder, 'node_modules/@types');
  if (!existsSync(types)) symlinkSync(join(REPOSITORY, 'node_modules/@types'), types);
  /** @param {string} name @param {object} options @param {string[]} files */
  const check = (name, options, files) => {
    const compilerOptions = {
      strict: true,
      noEmit: true,
      target: 'es2022',
      skipLibCheck: false,
      exactOptionalPropertyTypes: true,
      ...options,
    };
    writeFileSync(
      join(folder, `tsconfig.${name}.json`),
      JSON.stringify({ compilerOptions, files }),
    );
    run(folder, join(REPOSITORY, 'node_modules/.bin/tsc'), '-p', `tsconfig.${name}.json`);
  };
  const page = { types: [], lib: ['es2022', 'dom', 'dom.iterable'] };
  check('bundler', { ...page, module: 'esnext', moduleResolution: 'bundler' }, ['uses.mts']);
  check('node16', { ...page, module: 'node16', moduleResolution: 'node16' }, [
    'uses.mts',
    'uses.cts',
  ]);
  check('nodenext', { ...page, module: 'nodenext' }, ['uses.mts']);
  // Without DOM types.
  check('node', { types: ['node'], lib: ['es2022'], module: 'nodenext' }, ['core.mts']);
});

test('the manifest lists every attribute, event, member, property and part', async () => {
  const { RelightablePhotoElement } = await import(at('dist/element.js'));
  const element = manifestOf(place);
  const names = (/** @type {{ name: string }[]} */ entries) =>
    entries.map(({ name }) => name).sort();
  /** @type {string[]} */
  const attributes = RelightablePhotoElement.observedAttributes;
  // `lang` is an attribute of every HTML element.
  const own = attributes.filter((name) => name !== 'lang');
  assert.deepEqual(names(element.attributes ?? []), own.sort());
  const map = readFileSync(join(place, 'dist/types/element/events.d.ts'), 'utf8');
  const body = /interface RelightablePhotoEventMap [^{]*\{([^}]*)\}/.exec(map)?.[1] ?? '';
  const events = [...body.matchAll(/^\s*'?(\w+)'?:/gm)].map(([, name]) => String(name));
  assert.ok(events.length >= 6);
  assert.deepEqual(names(element.events), events.sort());
  const members = Object.getOwnPropertyNames(RelightablePhotoElement.prototype);
  const open = members.filter((name) => name !== 'constructor' && !name.endsWith('Callback'));
  const [ofClass, ofElements] = [true, false].map((isStatic) =>
    element.members.filter((member) => Boolean(member.static) === isStatic),
  );
  assert.deepEqual(names(ofElements ?? []), open.sort());
  const builtIn = ['length', 'name', 'prototype', 'observedAttributes'];
  const statics = Object.getOwnPropertyNames(RelightablePhotoElement);
  assert.deepEqual(names(ofClass ?? []), statics.filter((name) => !builtIn.includes(name)).sort());
  const read = (/** @type {string} */ part) =>
    readFileSync(join(place, `dist/relightable-photo${part}.js`), 'utf8');
  const script = ['', '-controls', '-input', '-minimap'].map(read).join();
  const properties = new Set(script.match(/--relightable-photo-[a-z-]+/g));
  assert.deepEqual(names(element.cssProperties), [...properties].sort());
  const parts = [...script.matchAll(/\bpart["'`]?[:=,]\s*["'`]([a-z- ]+)/g)].flatMap(([, part]) =>
    String(part).split(' '),
  );
  assert.deepEqual(names(element.cssParts), [...new Set(parts)].sort());
});

test('the core decodes and relights in Node', async (t) => {
  /** @type {typeof import('../../www/src/core.js')} */
  const core = await import(at('dist/core.js'));
  const { decode, relight } = core;
  /** @param {import('../../www/src/core.js').Photograph} photo */
  const check = async (photo) => {
    for (const light of /** @type {const} */ (['flood', 'torch', 'fire'])) {
      const { width, height, pixels } = await relight(photo, light, { exposure: 2 });
      const native = nativePicture(light, { backend: 'cpu', exposure: 2 });
      const { worst } = compare({ width, height, data: new Uint8Array(pixels.buffer) }, native);
      assert.ok(worst <= 1, `${light} differs by ${worst}/255 from ltm-export`);
    }
    photo.free();
    photo.free();
  };
  const file = join(folder, 'glass.ltm');
  writeFileSync(file, glassBytes);

  await t.test('from bytes', async () => {
    /** @type {number[][]} */
    const told = [];
    const photo = await decode(glassBytes, { onProgress: (...args) => told.push(args) });
    assert.deepEqual([photo.width, photo.height], [64, 64]);
    assert.equal(typeof photo.metadata, 'object');
    assert.deepEqual(told.at(-1), [glassBytes.length, glassBytes.length]);
    await check(photo);
  });
  await t.test('from a file', async () => check(await decode(pathToFileURL(file))));
  await t.test('from an iterable, a stream, a Blob', async () => {
    async function* pieces() {
      for (let i = 0; i < glassBytes.length; i += 10_000) yield glassBytes.subarray(i, i + 10_000);
    }
    await check(await decode(pieces()));
    const blob = new Blob([new Uint8Array(glassBytes)]);
    await check(await decode(/** @type {ReadableStream<Uint8Array>} */ (blob.stream())));
    await check(await decode(blob));
  });
  await t.test('from a server', async () => {
    const server = createServer((_, response) => response.end(glassBytes)).listen(0, '127.0.0.1');
    await new Promise((resolve) => server.once('listening', resolve));
    const { port } = /** @type {import('node:net').AddressInfo} */ (server.address());
    try {
      await check(await decode(`http://127.0.0.1:${port}/glass.ltm`));
    } finally {
      server.closeAllConnections();
      server.close();
    }
  });
  await t.test('lights of every kind', async () => {
    const photo = await decode(glassBytes);
    const bright = async (/** @type {import('../../www/src/core.js').Light} */ light) => {
      const { pixels } = await relight(photo, light);
      return pixels.reduce((sum, value, i) => sum + (i % 4 === 3 ? 0 : value), 0);
    };
    const white = new Float32Array(3).fill(1);
    const flood = await bright('flood');
    assert.equal(await bright({ data: white, width: 1, height: 1 }), flood);
    const codes = new Uint8ClampedArray(4).fill(255);
    assert.equal(await bright({ data: codes, width: 1, height: 1 }), flood);
    const [small, large] = [
      await bright({ x: 0.5, y: 0.5, size: 0.05 }),
      await bright({ x: 0.5, y: 0.5 }),
    ];
    assert.ok(0 < small && small < large && large < flood);
    photo.free();
  });
  await t.test('failures have codes', async () => {
    const code = (/** @type {string} */ code) => (/** @type {unknown} */ error) =>
      error instanceof core.PhotoError && error.code === code;
    await assert.rejects(decode(Buffer.from('no photograph')), code('format-magic'));
    await assert.rejects(decode(glassBytes.subarray(0, 50_000)), code('format-truncated'));
    await assert.rejects(decode(Buffer.concat([glassBytes, glassBytes])), code('format-invalid'));
    await assert.rejects(decode('window.ltm'), code('src-missing'));
    await assert.rejects(decode(pathToFileURL('/nothing.ltm')), code('http-status'));
    await assert.rejects(decode(/** @type {any} */ (7)), TypeError);
    await assert.rejects(decode(glassBytes, { signal: AbortSignal.abort() }), {
      name: 'AbortError',
    });
    const photo = await decode(glassBytes);
    await assert.rejects(relight(photo, /** @type {any} */ ('moon')), code('attribute'));
    await assert.rejects(relight(photo, 'flood', { exposure: -1 }), code('attribute'));
    for (const quality of [-1, 7, Number.NaN])
      await assert.rejects(relight(photo, 'flood', { quality }), code('attribute'));
    await assert.rejects(relight(/** @type {any} */ ({}), 'flood'), TypeError);
    photo.free();
    await assert.rejects(relight(photo), core.PhotoError);
  });
});

test('the core uses provided WebAssembly', () => {
  // In a process of its own, as modules start once; without Node's file access.
  const script = `
    import { readFileSync } from 'node:fs';
    import { decode, provideWasm, relight } from 'relightable-photo/core';
    process.getBuiltinModule = undefined;
    const read = (name) => readFileSync(new URL(import.meta.resolve('relightable-photo/wasm/' + name)));
    const bytes = readFileSync('glass.ltm');
    await decode(bytes).then(() => { throw new Error('found') }, ({ code }) => console.log(code));
    provideWasm({ ${CORE_MODULES.map((name) => `${name}: read('${name}_bg.wasm')`)} });
    const { pixels } = await relight(await decode(bytes));
    console.log(pixels.length);
  `;
  writeFileSync(join(folder, 'given.mjs'), script);
  writeFileSync(join(folder, 'glass.ltm'), glassBytes);
  assert.equal(run(folder, process.execPath, 'given.mjs'), 'wasm-unavailable\n16384\n');
  assert.ok(statSync(join(folder, 'glass.ltm')).size > 0);
});
