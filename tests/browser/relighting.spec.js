/** Each backend draws every light as ltm-export does. */

import { compare } from '../../www/tools/pictures.js';
import { expect, note, test } from './fixtures.js';
import {
  capturePicture,
  mountPhoto,
  screenPicture,
  waitForEvents,
  waitForLoad,
} from './page-helpers.js';
import { LIGHTS, nativePicture, TALL_FILE } from './test-photos.js';

const BACKENDS = ['webgpu', 'webgl2', 'cpu'];
const SRC = '/photos/glass.ltm';

const removeWorkers = () => {
  Reflect.deleteProperty(globalThis, 'Worker');
};

test.describe('relighting', () => {
  for (const backend of BACKENDS) {
    test(`${backend} draws as ltm-export does`, async ({ openPage, step }) => {
      const page = await openPage('/plain', { reducedMotion: 'reduce' });
      await mountPhoto(page, { src: SRC, backend, light: 'spectrum' });
      const photoEvents = await waitForLoad(page);
      const change = photoEvents.find((event) => event.type === 'backendchange');
      expect(change).toStrictEqual({ type: 'backendchange', backend, previous: null, reason: '' });

      await step(`${backend} presents its picture on the screen`, async () => {
        const shown = await screenPicture(page);
        // Presentation may round once more.
        expect(shown).toMatchPicture(nativePicture('spectrum'), 2);
      });

      await step(`${backend} agrees with ltm-export to 1/255`, async () => {
        for (const light of LIGHTS) {
          const drawn = await capturePicture(page, { light });
          for (const native of /** @type {const} */ (['cpu', 'reference'])) {
            const { worst, psnr } = compare(drawn, nativePicture(light, { backend: native }));
            note(`${light} against native ${native}: worst ${worst}/255, ${psnr.toFixed(1)} dB`);
            expect
              .soft(worst, `${light} differs by ${worst}/255 from native ${native}`)
              .toBeLessThanOrEqual(1);
          }
        }
      });

      await step(`${backend} draws the torch at the same position as ltm-export`, async () => {
        for (const point of [
          { x: 0.3, y: 0.65 },
          { x: 1, y: 0 },
        ]) {
          const drawn = await capturePicture(page, { light: 'torch' }, point);
          expect(drawn, 'the torch moved').not.toMatchPicture(nativePicture('torch'), 20);
          expect(drawn).toMatchPicture(nativePicture('torch', { torch: point }), 1);
        }
      });

      await step(`${backend} scales by the exposure`, async () => {
        const bright = await capturePicture(page, { light: 'spectrum', exposure: '2.5' });
        expect(bright).toMatchPicture(nativePicture('spectrum', { exposure: 2.5 }), 1);
      });

      await step(
        `${backend} draws several tiles, and scales by the exposure from the first frame on`,
        async () => {
          await page.evaluate("photo.exposure = 0.4, photo.src = '/photos/tall.ltm'");
          await waitForEvents(page, 'load', 2);
          const native = nativePicture('spectrum', { photo: TALL_FILE, exposure: 0.4 });
          expect(await capturePicture(page)).toMatchPicture(native, 1);
        },
      );
    });
  }

  test('workers and the main thread draw identical pictures', async ({ openPage }) => {
    const pooled = await openPage('/plain');
    const single = await openPage('/plain', { before: removeWorkers });
    for (const src of [SRC, '/photos/tall.ltm']) {
      for (const page of [pooled, single]) {
        await page.evaluate('globalThis.photo?.remove()');
        await mountPhoto(page, { src, backend: 'cpu' });
        await page.evaluate('photo.pause()');
        await waitForLoad(page);
      }
      expect(await pooled.evaluate('photo.kernel')).toMatch(/^simd128, \d workers?$/);
      expect(await single.evaluate('photo.kernel')).toBe('simd128');
      for (const light of LIGHTS) {
        const [one, other] = await Promise.all([
          capturePicture(pooled, { light }),
          capturePicture(single, { light }),
        ]);
        expect(one, `${src}, ${light}`).toMatchPicture(other, 0);
      }
      // Workers reuse the previous light's memory.
      for (let i = 0; i < 5; i += 1) {
        const torch = { x: 0.1 + 0.2 * i, y: 0.9 - 0.2 * i };
        const attributes = { light: 'torch', exposure: String(0.5 + i) };
        const [one, other] = await Promise.all([
          capturePicture(pooled, attributes, torch),
          capturePicture(single, attributes, torch),
        ]);
        expect(one, `${src}, torch ${i}`).toMatchPicture(other, 0);
      }
    }
  });

  test('the modules with and without SIMD draw identical pictures', async ({ openPage }) => {
    // Workers would choose their module themselves.
    const simd = await openPage('/plain', { before: removeWorkers });
    const scalar = await openPage('/plain', {
      before: () => {
        Reflect.deleteProperty(globalThis, 'Worker');
        WebAssembly.validate = () => false;
      },
    });
    for (const page of [simd, scalar]) {
      await mountPhoto(page, { src: SRC, backend: 'cpu', light: 'spectrum' });
      await waitForLoad(page);
    }
    expect(await simd.evaluate('photo.kernel')).toBe('simd128');
    expect(await scalar.evaluate('photo.kernel')).toBe('scalar');
    expect(await capturePicture(simd)).toMatchPicture(await capturePicture(scalar), 0);
  });
});
