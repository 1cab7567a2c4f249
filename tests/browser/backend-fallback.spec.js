/** When a backend is unavailable or is lost, the next one in the list is used. */

import { expect, test } from './fixtures.js';
import {
  alertOf,
  capturePicture,
  mountPhoto,
  openAlertDetails,
  removeGraphics,
  skipPausesUntil,
  waitForEvents,
  waitForLoad,
  waitUntil,
} from './page-helpers.js';
import { nativePicture } from './test-photos.js';

const GLASS = { src: '/photos/glass.ltm', light: 'spectrum' };
/** Software renderers are used only where `backend` names them. */
const ALL = { ...GLASS, backend: 'webgpu webgl2 cpu' };

const removeWebGpu = () => {
  Object.defineProperty(Navigator.prototype, 'gpu', { get: () => undefined });
};
/** @param {import('./page-helpers.js').ElementEvent[]} photoEvents */
const backendChanges = (photoEvents) =>
  photoEvents.filter((event) => event.type === 'backendchange');

/** @param {import('@playwright/test').Page} page */
async function expectSpectrum(page) {
  expect(await capturePicture(page)).toMatchPicture(nativePicture('spectrum'), 1);
}

test.describe('the fallback', () => {
  test('is WebGL2 without WebGPU', async ({ openPage }) => {
    const page = await openPage('/plain', { before: removeWebGpu });
    await mountPhoto(page, ALL);
    const [change] = backendChanges(await waitForLoad(page));
    expect(change?.['backend']).toBe('webgl2');
    expect(String(change?.['reason'])).toMatch(/^WebGPU: /);
    await expectSpectrum(page);
  });

  test('is the CPU without WebGPU and WebGL2', async ({ openPage }) => {
    const page = await openPage('/plain', { before: removeGraphics });
    await mountPhoto(page, GLASS);
    const [change] = backendChanges(await waitForLoad(page));
    expect(change?.['backend']).toBe('cpu');
    expect(String(change?.['reason'])).toMatch(/WebGPU: .*WebGL2: /);
    await expectSpectrum(page);
  });

  test('is WebGL2 when WebGPU does not answer', async ({ openPage }) => {
    const page = await openPage('/plain', {
      fakeClock: true,
      before: () => {
        /** @type {any} */ (globalThis).GPU.prototype.requestAdapter = () => new Promise(() => {});
      },
    });
    await skipPausesUntil(page, 'backendchange', () => mountPhoto(page, ALL));
    const [change] = backendChanges(await waitForLoad(page));
    expect(change?.['backend']).toBe('webgl2');
    expect(String(change?.['reason'])).toMatch(/^WebGPU: it does not answer/);
    await expectSpectrum(page);
  });

  test('follows the order of the backend attribute', async ({ openPage }) => {
    const page = await openPage('/plain');
    await mountPhoto(page, { ...GLASS, backend: 'cpu webgpu' });
    expect(backendChanges(await waitForLoad(page))[0]?.['backend']).toBe('cpu');
  });

  test('to no backend is an error, which another backend attribute resolves', async ({
    openPage,
  }) => {
    const page = await openPage('/plain', { before: removeGraphics });
    await mountPhoto(page, { ...GLASS, backend: 'webgpu webgl2' });
    const photoEvents = await waitForEvents(page, 'error');
    expect(photoEvents.at(-1)?.['code']).toBe('backend-unavailable');
    await (await openAlertDetails(page))
      .getByText('This browser cannot draw the photograph')
      .waitFor();
    await page.evaluate("photo.backend = 'webgpu webgl2 cpu'");
    await waitForEvents(page, 'load');
    await alertOf(page).waitFor({ state: 'hidden' });
    await expectSpectrum(page);
  });

  test('is the CPU when WebGPU and WebGL2 are software renderers', async ({ openPage }) => {
    const page = await openPage('/plain');
    await mountPhoto(page, GLASS);
    const [change] = backendChanges(await waitForLoad(page));
    expect(change?.['backend']).toBe('cpu');
    expect(String(change?.['reason'])).toMatch(
      /WebGPU: its device is a software renderer.*WebGL2: its device is a software renderer/,
    );
    await expectSpectrum(page);
  });

  test('is WebGL2 when the WebGPU device is lost before its first use', async ({ openPage }) => {
    const page = await openPage('/plain', {
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
    await mountPhoto(page, ALL);
    const [change] = backendChanges(await waitForLoad(page));
    expect(change?.['backend']).toBe('webgl2');
    expect(String(change?.['reason'])).toMatch(/^WebGPU: /);
    await expectSpectrum(page);
  });

  test('is WebGL2 when the canvas refuses WebGPU, and the device is destroyed', async ({
    openPage,
  }) => {
    const page = await openPage('/plain', {
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
    await mountPhoto(page, { ...GLASS, backend: 'webgpu webgl2' });
    const [change] = backendChanges(await waitForLoad(page));
    expect(change?.['backend']).toBe('webgl2');
    expect(String(change?.['reason'])).toMatch(/^WebGPU: the canvas gives no WebGPU context/);
    expect(await page.evaluate('globalThis.destroyed')).toBe(true);
  });

  test('changes whenever the backend attribute does', async ({ openPhoto }) => {
    const page = await openPhoto({ ...GLASS, backend: 'cpu' });
    for (const backend of ['webgl2', 'webgpu', 'cpu']) {
      await page.evaluate(`photo.backend = '${backend}'`);
      await waitUntil(page, `photo.activeBackend === '${backend}'`);
      await expectSpectrum(page);
    }
  });
});
