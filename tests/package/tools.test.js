/** The packed package in projects of others: built by their tools, and loaded in a browser. */

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { compare } from '../../www/tools/pictures.js';
import { nativePicture } from '../browser/photos.js';
import { project, run, unpacked } from './packed.js';
import { visit } from './page.js';

/** What the page's photograph looks like, whoever has built the page. */
const expected = nativePicture('torch', 'cpu');

/**
 * Holds a visit against what every page has to be.
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
  assert.deepEqual(others, [], 'all is of the page’s own server');
  assert.deepEqual([...requests, ...workers].filter((url) => !/^https?:/.test(url)), []);
}

/** @param {import('./page.js').Visit} visit */
function checkWorkers({ state, workers }) {
  assert.equal(state['activeBackend'], 'cpu');
  assert.match(String(state['kernel']), /^simd128, \d workers?$/);
  // One that decodes and one that relights.
  assert.ok(workers.length >= 2, `workers: ${workers}`);
}

/** @param {{ at: string, folder: string }[]} mounts */
async function checkSite(mounts) {
  const site = await visit(mounts);
  check(site);
  checkWorkers(site);
  const onGpu = await visit(mounts, { backend: 'webgl2' });
  check(onGpu);
  assert.equal(onGpu.state['activeBackend'], 'webgl2');
}

test('a plain script', async () => {
  const { place } = unpacked();
  await checkSite([
    { at: '/relightable-photo/', folder: join(place, 'dist') },
    { at: '/', folder: join(import.meta.dirname, 'plain') },
  ]);
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

test('Next, which renders on the server first', async () => {
  const folder = project('next');
  run(folder, 'npm', 'run', 'build');
  const html = readFileSync(join(folder, 'out/index.html'), 'utf8');
  assert.match(html, /<relightable-photo [^>]*src="\/photos\/glass\.ltm"/);
  assert.match(html, /<relightable-photo [^>]*white-balance="1 1 1"/);
  await checkSite([{ at: '/', folder: join(folder, 'out') }]);
});
