/** Builds projects that use the packed package with common tools, and loads them in a browser. */

import assert from 'node:assert/strict';
import { createHash } from 'node:crypto';
import { cpSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { compare } from '../../www/tools/pictures.js';
import { makeTestPhotos, nativePicture } from '../browser/test-photos.js';
import { manifestOf, project, REPOSITORY, run, unpacked } from './packed.js';
import { draw, useWindow, visit } from './page.js';

const SCRIPT = 'relightable-photo.js';
/** The samples of the guides. */
const SAMPLES = join(REPOSITORY, 'docs/samples');

/** The expected picture, whatever tool built the page. */
makeTestPhotos();
const expected = nativePicture('torch', { backend: 'cpu' });

/**
 * Checks what every page must fulfil.
 *
 * @param {import('./page.js').Visit} visit
 */
function check({ picture, state, workers, requests, complaints, origin }) {
  assert.deepEqual(complaints, []);
  assert.equal(state['error'], '');
  assert.equal(state['loads'], 1);
  const { worst } = compare(picture, expected);
  assert.ok(worst <= 1, `the picture differs by ${worst}/255 from that of ltm-export`);
  assert.ok(picture.data.some((value, i) => i % 4 !== 3 && value > 100));
  const others = [...requests, ...workers].filter((url) => new URL(url).origin !== origin);
  assert.deepEqual(others, [], 'requests to other servers');
  assert.deepEqual(
    [...requests, ...workers].filter((url) => !/^https?:/.test(url)),
    [],
  );
}

/** @param {import('./page.js').Visit} visit */
function checkWorkers({ state, workers }) {
  assert.equal(state['activeBackend'], 'cpu');
  assert.match(String(state['kernel']), /^simd128, \d workers?$/);
  // One worker decodes, another relights.
  assert.ok(workers.length >= 2, `workers: ${workers}`);
}

/** @param {{ at: string, folder: string }[]} mounts @param {string} [scripts] as of `visit` */
async function checkSite(mounts, scripts) {
  const site = await visit(mounts, {}, scripts);
  check(site);
  checkWorkers(site);
  const onGpu = await visit(mounts, { backend: 'webgl2' }, scripts);
  check(onGpu);
  assert.equal(onGpu.state['activeBackend'], 'webgl2');
  return onGpu;
}

test('a plain script', async () => {
  const { folder, place } = unpacked();
  // The integrity attribute has the hash of integrity.json.
  const hash = JSON.parse(readFileSync(join(place, 'dist/integrity.json'), 'utf8'))[SCRIPT];
  const html = readFileSync(join(import.meta.dirname, 'plain/index.html'), 'utf8');
  writeFileSync(
    join(folder, 'index.html'),
    html.replace(`${SCRIPT}"`, `${SCRIPT}" integrity="${hash}"`),
  );
  const { state } = await checkSite([
    { at: '/relightable-photo/', folder: join(place, 'dist') },
    { at: '/', folder },
  ]);
  const { cssParts, slots } = manifestOf(place);
  const told = (/** @type {{ name: string }[]} */ entries) => entries.map(({ name }) => name);
  const lacking = (/** @type {unknown} */ there, /** @type {string[]} */ known) =>
    /** @type {string[]} */ (there).filter((name) => !known.includes(name));
  assert.deepEqual(lacking(state['parts'], told(cssParts)), [], 'parts that the manifest lacks');
  assert.deepEqual(lacking(state['slots'], told(slots)), [], 'slots that the manifest lacks');
});

test('the core in a worker of a page', async () => {
  const { place } = unpacked();
  const { picture, complaints } = await draw([
    { at: '/relightable-photo/', folder: join(place, 'dist') },
    { at: '/', folder: join(import.meta.dirname, 'core') },
  ]);
  assert.deepEqual(complaints, []);
  const { worst } = compare(picture, expected);
  assert.ok(worst <= 1, `the picture differs by ${worst}/255 from that of ltm-export`);
});

test('Vite', async () => {
  const folder = project('vite');
  run(folder, 'npm', 'run', 'build');
  await checkSite([{ at: '/', folder: join(folder, 'dist') }]);
});

test('webpack', async () => {
  const folder = project('webpack');
  run(folder, 'npm', 'run', 'build');
  await checkSite([{ at: '/', folder: join(folder, 'public') }]);
});

/**
 * Checks a page of the guide's component, with a photograph and with a wrong address.
 *
 * @param {{ at: string, folder: string }[]} mounts
 * @param {{ good: string, wrong: string }} paths
 * @param {string} [scripts] as of `visit`
 */
async function checkWindow(mounts, { good, wrong }, scripts) {
  const shown = await useWindow(mounts, good, scripts);
  assert.deepEqual(shown, { message: '', faults: [] });
  const failed = await useWindow(mounts, wrong, scripts);
  assert.match(failed.message, /missing\.ltm/);
  assert.deepEqual(failed.faults, []);
}

test('the guide’s component in Vue, also rendered by a server', async () => {
  const folder = project('vue');
  cpSync(join(SAMPLES, 'vite.config.js'), join(folder, 'vite.config.js'));
  cpSync(join(SAMPLES, 'Window.vue'), join(folder, 'src/Window.vue'));
  run(folder, 'npm', 'run', 'build');
  const mounts = [{ at: '/', folder: join(folder, 'dist') }];
  const [good, wrong] = ['/?src=/photos/glass.ltm', '/?src=/photos/missing.ltm'];
  await checkWindow(mounts, { good, wrong });
  const html = run(folder, 'npm', 'run', '--silent', 'render');
  assert.match(html, /<relightable-photo [^>]*src="\/photos\/glass\.ltm"[^>]*light="torch"/);
});

test('Next, with server rendering, and the guide’s component in it', async () => {
  const folder = project('next');
  cpSync(join(SAMPLES, 'Window.jsx'), join(folder, 'Window.jsx'));
  run(folder, 'npm', 'run', 'build');
  const html = readFileSync(join(folder, 'out/index.html'), 'utf8');
  assert.match(html, /<relightable-photo [^>]*src="\/photos\/glass\.ltm"/);
  assert.match(html, /<relightable-photo [^>]*white-balance="1 1 1"/);
  // Next writes an inline script, which the policy allows by its hash.
  const mounts = [{ at: '/', folder: join(folder, 'out') }];
  const { state } = await checkSite(mounts, hashesOfScripts(html));
  // React has hydrated the page.
  assert.equal(state['output'], 'webgl2');
  const sample = readFileSync(join(folder, 'out/sample.html'), 'utf8');
  assert.match(sample, /<relightable-photo [^>]*src="\/photos\/glass\.ltm"/);
  const scripts = ['sample', 'failing'].map((name) =>
    hashesOfScripts(readFileSync(join(folder, `out/${name}.html`), 'utf8')),
  );
  await checkWindow(mounts, { good: '/sample', wrong: '/failing' }, scripts.join(''));
  // The types compile without skipLibCheck, which Next's own types need.
  run(folder, join(folder, 'node_modules/.bin/tsc'), '-p', 'types');
});

/** Returns the policy's hashes of a page's inline scripts. @param {string} html */
function hashesOfScripts(html) {
  const scripts = [...html.matchAll(/<script>(.*?)<\/script>/gs)];
  const hashes = scripts.map(([, text = '']) => createHash('sha256').update(text).digest('base64'));
  return hashes.map((hash) => ` 'sha256-${hash}'`).join('');
}
