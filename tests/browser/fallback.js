/** A back end that cannot be had, or goes away, is replaced by the next. */

import assert from 'node:assert/strict';
import { describe, test } from 'node:test';
import { compare } from '../../www/tools/pictures.js';
import {
  details,
  happenedUntil,
  loaded,
  message,
  mount,
  openPage,
  picture,
  withoutGpus,
} from './browser.js';
import { nativePicture } from './photos.js';

const GLASS = { src: '/photos/glass.ltm', light: 'spectrum' };
/** Named, as by default no device that is a program is taken. */
const ALL = { ...GLASS, backend: 'webgpu webgl2 cpu' };

const withoutWebGpu = () => {
  Object.defineProperty(Navigator.prototype, 'gpu', { get: () => undefined });
};
/** @param {import('./browser.js').Happening[]} happened */
const changes = (happened) => happened.filter((event) => event.type === 'backendchange');

/** @param {import('playwright-core').Page} page */
async function drawsRight(page) {
  assert.ok(compare(await picture(page), nativePicture('spectrum', 'reference')).worst <= 1);
}

describe('falling back', () => {
  test('without WebGPU to WebGL2', async (t) => {
    const page = await openPage(t, '/bench', { before: withoutWebGpu });
    await mount(page, ALL);
    const [change] = changes(await loaded(page));
    assert.equal(change?.['backend'], 'webgl2');
    assert.match(String(change?.['reason']), /^WebGPU: /);
    await drawsRight(page);
  });

  test('without WebGPU and WebGL2 to the CPU', async (t) => {
    const page = await openPage(t, '/bench', { before: withoutGpus });
    await mount(page, GLASS);
    const [change] = changes(await loaded(page));
    assert.equal(change?.['backend'], 'cpu');
    assert.match(String(change?.['reason']), /WebGPU: .*WebGL2: /);
    await drawsRight(page);
  });

  test('where WebGPU never answers, to WebGL2', async (t) => {
    const page = await openPage(t, '/bench', {
      before: () => {
        /** @type {any} */ (globalThis).GPU.prototype.requestAdapter = () => new Promise(() => {});
      },
    });
    await mount(page, ALL);
    const [change] = changes(await loaded(page));
    assert.equal(change?.['backend'], 'webgl2');
    assert.match(String(change?.['reason']), /^WebGPU: it does not answer/);
    await drawsRight(page);
  });

  test('in the order that is asked for', async (t) => {
    const page = await openPage(t, '/bench');
    await mount(page, { ...GLASS, backend: 'cpu webgpu' });
    assert.equal(changes(await loaded(page))[0]?.['backend'], 'cpu');
  });

  test('to nothing is an error that can be read, and mended', async (t) => {
    const page = await openPage(t, '/bench', { before: withoutGpus });
    await mount(page, { ...GLASS, backend: 'webgpu webgl2' });
    const happened = await happenedUntil(page, 'error');
    assert.equal(happened.at(-1)?.['code'], 'backend-unavailable');
    await (await details(page)).getByText('This browser cannot draw the photograph').waitFor();
    await page.evaluate("photo.backend = 'webgpu webgl2 cpu'");
    await happenedUntil(page, 'load');
    await message(page).waitFor({ state: 'hidden' });
    await drawsRight(page);
  });

  test('from devices that are programs to the CPU, which is faster', async (t) => {
    const page = await openPage(t, '/bench');
    await mount(page, GLASS);
    const [change] = changes(await loaded(page));
    assert.equal(change?.['backend'], 'cpu');
    assert.match(
      String(change?.['reason']),
      /WebGPU: it is done by a program.*WebGL2: it is done by a program/,
    );
    await drawsRight(page);
  });

  test('when the WebGPU device is lost before it is used', async (t) => {
    const page = await openPage(t, '/bench', {
      before: () => {
        const adapter = /** @type {any} */ (globalThis).GPUAdapter.prototype;
        const { requestDevice } = adapter;
        adapter.requestDevice = /** @this {any} @param {any[]} options */ async function (
          ...options
        ) {
          const device = await Reflect.apply(requestDevice, this, options);
          device.destroy();
          await device.lost;
          return device;
        };
      },
    });
    await mount(page, ALL);
    const [change] = changes(await loaded(page));
    assert.equal(change?.['backend'], 'webgl2');
    assert.match(String(change?.['reason']), /^WebGPU: /);
    await drawsRight(page);
  });

  test('when the canvas refuses WebGPU, whose device is given back', async (t) => {
    const page = await openPage(t, '/bench', {
      before: () => {
        const { getContext } = HTMLCanvasElement.prototype;
        HTMLCanvasElement.prototype.getContext = /** @type {any} */ (
          /** @this {HTMLCanvasElement} @param {string} kind @param {any[]} rest */
          function (kind, ...rest) {
            return kind === 'webgpu' ? null : Reflect.apply(getContext, this, [kind, ...rest]);
          }
        );
        const device = /** @type {any} */ (globalThis).GPUDevice.prototype;
        const { destroy } = device;
        device.destroy = /** @this {any} */ function () {
          Object.assign(globalThis, { destroyed: true });
          Reflect.apply(destroy, this, []);
        };
      },
    });
    await mount(page, { ...GLASS, backend: 'webgpu webgl2' });
    const [change] = changes(await loaded(page));
    assert.equal(change?.['backend'], 'webgl2');
    assert.match(String(change?.['reason']), /^WebGPU: the canvas gives no WebGPU context/);
    assert.equal(await page.evaluate('globalThis.destroyed'), true);
  });

  test('and back, while the page runs', async (t) => {
    const page = await openPage(t, '/bench');
    await mount(page, { ...GLASS, backend: 'cpu' });
    await loaded(page);
    for (const backend of ['webgl2', 'webgpu', 'cpu']) {
      const before = (await page.evaluate('happened')).length;
      await page.evaluate((backend) => {
        /** @type {any} */ (globalThis).photo.backend = backend;
      }, backend);
      await page.waitForFunction(
        (n) => /** @type {any} */ (globalThis).happened.length > n,
        before,
      );
      assert.equal(await page.evaluate('photo.activeBackend'), backend);
      await drawsRight(page);
    }
  });
});
