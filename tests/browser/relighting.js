/** Every light on every back end, held against the native program. */

import assert from 'node:assert/strict';
import { describe, test } from 'node:test';
import { compare, decodePng } from '../../www/tools/pictures.js';
import { loaded, mount, openPage, picture } from './browser.js';
import { LIGHTS, nativePicture } from './photos.js';

const BACKENDS = ['webgpu', 'webgl2', 'cpu'];
const SRC = '/photos/glass.ltm';

describe('relighting', () => {
  for (const backend of BACKENDS) {
    test(`${backend} draws what the native program draws, to 1/255`, async (t) => {
      const page = await openPage(t, '/bench');
      await mount(page, { src: SRC, backend });
      const happened = await loaded(page);
      const change = happened.find((event) => event.type === 'backendchange');
      assert.deepEqual(change, { type: 'backendchange', backend, previous: null, reason: '' });
      for (const light of LIGHTS) {
        const drawn = await picture(page, { light });
        for (const twin of /** @type {const} */ (['cpu', 'reference'])) {
          const { worst, psnr } = compare(drawn, nativePicture(light, twin));
          t.diagnostic(`${light} against ${twin}: worst ${worst}/255, ${psnr.toFixed(1)} dB`);
          assert.ok(worst <= 1, `${light} differs by ${worst}/255 from native ${twin}`);
        }
      }
    });

    test(`${backend} scales by the exposure`, async (t) => {
      const page = await openPage(t, '/bench');
      await mount(page, { src: SRC, backend, exposure: '0.4' });
      await loaded(page);
      const dim = await picture(page, { light: 'spectrum' });
      assert.ok(compare(dim, nativePicture('spectrum', 'reference', 0.4)).worst <= 1);
      const bright = await picture(page, { exposure: '2.5' });
      assert.ok(compare(bright, nativePicture('spectrum', 'reference', 2.5)).worst <= 1);
    });

    test(`${backend} has the torch shine where the native program has it`, async (t) => {
      const page = await openPage(t, '/bench');
      await mount(page, { src: SRC, backend, light: 'torch' });
      await loaded(page);
      for (const point of [
        { x: 0.3, y: 0.65 },
        { x: 1, y: 0 },
      ]) {
        const drawn = await picture(page, {}, point);
        assert.ok(
          compare(drawn, nativePicture('torch', 'reference')).worst > 20,
          'it did not move',
        );
        const { worst } = compare(drawn, nativePicture('torch', 'reference', 1, point));
        assert.ok(worst <= 1, `a torch at ${point.x}, ${point.y} differs by ${worst}/255`);
      }
    });

    test(`${backend} shows on the screen what it draws`, async (t) => {
      const page = await openPage(t, '/bench');
      await mount(page, { src: SRC, backend, light: 'spectrum' });
      await loaded(page);
      const shown = decodePng(await page.locator('relightable-photo').screenshot());
      // The screen may round once more.
      assert.ok(compare(shown, nativePicture('spectrum', 'reference')).worst <= 2);
    });
  }

  test('without SIMD the other module draws, to the same bit', async (t) => {
    const simd = await openPage(t, '/bench');
    const scalar = await openPage(t, '/bench', {
      before: () => {
        WebAssembly.validate = () => false;
      },
    });
    for (const page of [simd, scalar]) {
      await mount(page, { src: SRC, backend: 'cpu', light: 'spectrum' });
      await loaded(page);
    }
    assert.equal(await simd.evaluate('photo.kernel'), 'simd128');
    assert.equal(await scalar.evaluate('photo.kernel'), 'scalar');
    assert.equal(compare(await picture(simd), await picture(scalar)).worst, 0);
  });
});
