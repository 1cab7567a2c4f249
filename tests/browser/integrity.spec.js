/** The element checks the WebAssembly that it loads, and starts workers on pages with Trusted Types. */

import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { expect, test } from './fixtures.js';
import { capturePicture, mountPhoto, waitForEvents, waitForLoad } from './page-helpers.js';
import { nativePicture } from './test-photos.js';

const GLASS = { src: '/photos/glass.ltm', backend: 'cpu', light: 'stripes' };
const WASM = join(import.meta.dirname, '../../dist/wasm');

test.describe('a WebAssembly module', () => {
  for (const [what, name, code] of /** @type {const} */ ([
    ['decoder', 'decoder_bg.wasm', 'wasm-unavailable'],
    ['backend', 'cpu_bg.wasm', 'backend-unavailable'],
  ])) {
    test(`of another release is refused as the ${what}`, async ({ openPage }) => {
      const page = await openPage('/plain');
      // A custom section changes nothing but the hash.
      const section = Buffer.from([0, 2, 1, 0x61]);
      const body = Buffer.concat([readFileSync(join(WASM, name)), section]);
      await page.route(`**/wasm/${name}`, (route) =>
        route.fulfill({ body, contentType: 'application/wasm' }),
      );
      await mountPhoto(page, GLASS);
      const error = (await waitForEvents(page, 'error')).find(({ type }) => type === 'error');
      expect(error?.['code']).toBe(code);
      expect(String(error?.['message'])).toContain('same release');
    });
  }

  test('is fetched from the folder in wasmUrl', async ({ openPage }) => {
    const page = await openPage('/plain');
    /** @type {string[]} */
    const fetched = [];
    await page.route('**/elsewhere/*', (route) => {
      const name = new URL(route.request().url()).pathname.replace('/elsewhere/', '');
      fetched.push(name);
      return route.fulfill({
        body: readFileSync(join(WASM, name)),
        contentType: 'application/wasm',
      });
    });
    const url = await page.evaluate(async () => {
      const element = /** @type {any} */ (await customElements.whenDefined('relightable-photo'));
      element.wasmUrl = 'elsewhere';
      return element.wasmUrl;
    });
    expect(url).toBe(new URL('/elsewhere/', page.url()).href);
    await mountPhoto(page, GLASS);
    await waitForLoad(page);
    expect(new Set(fetched)).toStrictEqual(new Set(['decoder_bg.wasm', 'cpu_bg.wasm']));
    expect(await capturePicture(page)).toMatchPicture(nativePicture('stripes'), 1);
  });
});

test('workers start on a page with Trusted Types', async ({ openPage }) => {
  const page = await openPage('/trusted-types/monitored');
  await mountPhoto(page, GLASS);
  await waitForLoad(page);
  expect(await capturePicture(page)).toMatchPicture(nativePicture('stripes'), 1);
  const { names, isRestored } = await page.evaluate(() => {
    const { workers } = /** @type {any} */ (globalThis);
    const answering = workers.filter((/** @type {any} */ { messages }) => messages > 0);
    const names = answering.map((/** @type {any} */ { url }) => url.split('/').at(-1));
    return { names, isRestored: !/createScriptURL/.test(String(Worker)) };
  });
  expect(names).toContain('relightable-photo-worker.js');
  expect(names).toContain('relightable-photo-relighter.js');
  expect(isRestored).toBe(true);
});
