/** Every light on every back end, held against the native program. */

import assert from 'node:assert/strict';
import { describe, test } from 'node:test';
import { compare, decodePng } from '../../www/tools/pictures.js';
import { loaded, mount, openPage, picture } from './browser.js';
import { LIGHTS, nativePicture } from './photos.js';

const BACKENDS = ['webgpu', 'webgl2', 'cpu'];
const SRC = '/photos/glass.ltm';

const withoutWorkers = () => {
  Reflect.deleteProperty(globalThis, 'Worker');
};

describe('relighting', () => {
  for (const backend of BACKENDS) {
    test(`${backend} draws what the native program draws, to 1/255`, async (t) => {
      const page = await openPage(t, '/bench', { reducedMotion: 'reduce' });
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

  test('workers draw what the page draws, to the same bit', async (t) => {
    const crew = await openPage(t, '/bench');
    const alone = await openPage(t, '/bench', { before: withoutWorkers });
    for (const src of [SRC, '/photos/stained-glass.ltm']) {
      for (const page of [crew, alone]) {
        await page.evaluate('globalThis.photo?.remove()');
        await mount(page, { src, backend: 'cpu' });
        await page.evaluate('photo.paused = true');
        await loaded(page);
      }
      assert.match(await crew.evaluate('photo.kernel'), /^simd128, \d workers?$/);
      assert.equal(await alone.evaluate('photo.kernel'), 'simd128');
      for (const light of LIGHTS) {
        const [one, other] = await Promise.all(
          [crew, alone].map((page) => picture(page, { light })),
        );
        assert.ok(one && other && compare(one, other).worst === 0, `${src}, ${light}`);
      }
      // What the last light has left, where it was as bright as the next.
      for (let i = 0; i < 5; i += 1) {
        const torch = { x: 0.1 + 0.2 * i, y: 0.9 - 0.2 * i };
        const attributes = { light: 'torch', exposure: String(0.5 + i) };
        const [one, other] = await Promise.all(
          [crew, alone].map((page) => picture(page, attributes, torch)),
        );
        assert.ok(one && other && compare(one, other).worst === 0, `${src}, torch ${i}`);
      }
    }
  });

  test('without SIMD the other module draws, to the same bit', async (t) => {
    // Without workers, whose modules are their own.
    const simd = await openPage(t, '/bench', { before: withoutWorkers });
    const scalar = await openPage(t, '/bench', {
      before: () => {
        Reflect.deleteProperty(globalThis, 'Worker');
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
