/** Tests for every browser, under the strictest policy that the element supports. */

import { compare } from '../../www/tools/pictures.js';
import { expect, note } from './fixtures.js';
import { checkLayoutBoxes } from './layout-boxes.js';
import {
  capturePicture,
  decodeDataUrl,
  dominantColour,
  drag,
  mountPhoto,
  pointOf,
  screenPicture,
  waitForEvents,
  waitForLoad,
} from './page-helpers.js';
import { testRecoverPage } from './recover-page-every-browser.js';
import { prepareRecovery, recoverFixture } from './recovery-page.js';
import { contentHash, glassBytes, LIGHTS, nativePicture } from './test-photos.js';

/** @typedef {import('./any-browser.js').AnyPage} AnyPage */
/** @typedef {import('./page-helpers.js').ElementEvent} ElementEvent */

/** PSNR of a recovered photograph's picture, if its file's is the truth: the file is coarser. */
const MIN_RECOVERED_PSNR_DB = 40;
const PAGE = '/monitored';
const SRC = '/photos/glass.ltm';
const ELEMENTS = 16;
const CYCLES = 10;

/**
 * Declares the tests for a browser.
 *
 * @param {typeof import('./fixtures.js').test} test
 * @param {object} browser
 * @param {string | null} browser.missingProgram how to install the browser, where it is missing
 * @param {readonly string[]} browser.backends that it has on this machine
 * @param {readonly string[]} browser.missingBackends
 * @param {boolean} browser.canReadScreen whether screenshots show the canvas
 * @param {boolean} browser.hasRendererNames whether pages can tell a GPU from a software renderer
 */
export function testEveryBrowser(test, browser) {
  const { missingProgram, backends, missingBackends, canReadScreen, hasRendererNames } = browser;
  if (missingProgram && process.env['CI']) throw new Error(`not installed: ${missingProgram}`);
  test.skip(missingProgram !== null, `NOT TESTED, not installed: ${missingProgram}`);

  testRecoverPage(test);

  test.describe('relighting', () => {
    for (const backend of backends) {
      test(`${backend} draws lights, the torch under the pointer, a canvas and a video`, async ({
        openAnyPage,
        step,
      }) => {
        const page = await openAnyPage(PAGE);
        await mountPhoto(page, { src: SRC, backend });
        const photoEvents = await waitForLoad(page);
        const change = photoEvents.find((event) => event.type === 'backendchange');
        expect(change).toStrictEqual({
          type: 'backendchange',
          backend,
          previous: null,
          reason: '',
        });
        note(`drawn by ${await page.evaluate('photo.kernel')}`);

        await step(`${backend} agrees with ltm-export to 1/255`, async () => {
          for (const light of LIGHTS) {
            const want = nativePicture(light);
            const { worst, psnr } = compare(await capturePicture(page, { light }), want);
            note(`${light}: worst ${worst}/255, ${psnr.toFixed(1)} dB`);
            expect(worst, `${light} differs by ${worst}/255`).toBeLessThanOrEqual(1);
          }
          const want = nativePicture('spectrum', { exposure: 2.5 });
          const bright = await capturePicture(page, { light: 'spectrum', exposure: '2.5' });
          expect(bright, 'the exposure').toMatchPicture(want, 1);
          // Presentation may round once more.
          if (canReadScreen)
            expect(await screenPicture(page), 'on the screen').toMatchPicture(want, 2);
        });

        await step(`the torch follows the pointer on ${backend}`, async () => {
          await page.evaluate("void (photo.exposure = 1, photo.light = 'torch')");
          await page.evaluate("void (photo.style.width = '320px')");
          const at = await pointOf(page);
          for (const [x, y] of /** @type {const} */ ([
            [0.25, 0.3],
            [0.75, 0.7],
          ])) {
            const point = at(x, y);
            await page.mouse.move(point.x, point.y);
            const torch = await page.evaluate('photo.torch');
            expect(torch, 'the torch has a position').toBeTruthy();
            expect(Math.abs(torch.x - x)).toBeLessThan(0.01);
            expect(Math.abs(torch.y - y)).toBeLessThan(0.01);
            const want = nativePicture('torch', { torch });
            expect(await capturePicture(page)).toMatchPicture(want, 1);
          }
        });

        await step(`a canvas and a video are light sources on ${backend}`, async () => {
          await page.evaluate("void (photo.light = 'flood')");
          await page.evaluate(() => {
            const canvas = Object.assign(document.createElement('canvas'), {
              width: 40,
              height: 30,
            });
            const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
            context.fillStyle = 'rgb(255 255 255 / 0.2)';
            context.fillRect(0, 0, 40, 30);
            /** @type {any} */ (globalThis).photo.light = canvas;
          });
          const fifth = nativePicture('flood', { exposure: 0.2 });
          expect(await capturePicture(page), 'the canvas').toMatchPicture(fifth, 1);
          await page.evaluate(async () => {
            const video = document.createElement('video');
            Object.assign(video, { muted: true, playsInline: true, src: '/film.webm' });
            Object.assign(globalThis, { video });
            /** @type {any} */ (globalThis).photo.light = video;
          });
          const colour = async () =>
            dominantColour(await (canReadScreen ? screenPicture(page) : capturePicture(page)));
          await expect.poll(colour).toBe('red');
          await page.evaluate('video.play()');
          await expect.poll(colour).toBe('blue');
        });
      });
    }

    for (const backend of missingBackends) {
      test(`without ${backend} the next backend draws and gives the reason`, async ({
        openAnyPage,
      }) => {
        const page = await openAnyPage(PAGE);
        await mountPhoto(page, {
          src: SRC,
          light: 'spectrum',
          backend: `${backend} ${backends[0]}`,
        });
        const photoEvents = await waitForLoad(page);
        const change = photoEvents.find((event) => event.type === 'backendchange');
        expect(change?.['backend']).toBe(backends[0]);
        expect(String(change?.['reason'])).toMatch(/\w+: \S+ \S+/);
        const want = nativePicture('spectrum');
        expect(await capturePicture(page)).toMatchPicture(want, 1);
      });
    }

    test('software renderers are used only where `backend` names them', async ({ openAnyPage }) => {
      test.skip(!hasRendererNames, 'the browser does not tell the name of the GPU');
      const page = await openAnyPage(PAGE);
      await mountPhoto(page, { src: SRC });
      const change = (await waitForLoad(page)).find((event) => event.type === 'backendchange');
      expect(change?.['backend'], await page.evaluate('photo.kernel')).toBe('cpu');
      note(String(change?.['reason']));
    });

    test('workers decode and relight', async ({ openAnyPage }) => {
      const page = await openAnyPage(PAGE);
      await mountPhoto(page, { src: SRC, backend: 'cpu' });
      await waitForLoad(page);
      expect(await page.evaluate('photo.kernel')).toMatch(/^simd128, \d workers?$/);
      /** @type {{ url: string, messages: number, failed: boolean }[]} */
      const workers = await page.evaluate('workers');
      for (const name of ['worker', 'relighter']) {
        const some = workers.filter(({ url }) => url.endsWith(`relightable-photo-${name}.js`));
        expect(some.length, `no ${name}`).toBeGreaterThan(0);
        expect(
          some.some(({ failed }) => failed),
          `a ${name} failed`,
        ).toBeFalsy();
        // The first message says that a worker is ready, the others that it works. A small photograph needs one worker.
        expect(
          some.some(({ messages }) => messages > 1),
          `no ${name} at work`,
        ).toBeTruthy();
      }
    });
  });

  test('a capture folder is recovered to the file that the command line writes', async ({
    openAnyPage,
  }) => {
    const page = await openAnyPage(PAGE);
    await prepareRecovery(page);
    const { file, seconds, heldOutSnr } = await recoverFixture(page);
    note(`${seconds.toFixed(2)} s, held out ${heldOutSnr} dB`);
    expect(contentHash(file)).toBe(contentHash(glassBytes()));
    await mountPhoto(page, { src: '/photos/tall.ltm', backend: 'cpu', light: 'stripes' });
    await page.evaluate(async () => {
      const { photo, recovered } = /** @type {any} */ (globalThis);
      photo.photograph = recovered;
      await photo.ready;
    });
    const { psnr } = compare(await capturePicture(page), nativePicture('stripes'));
    expect(psnr).toBeGreaterThan(MIN_RECOVERED_PSNR_DB);
    await page.evaluate('recovered.free()');
  });

  test.describe('an element', () => {
    test('moves its torch with the arrow keys and the pointer', async ({ openAnyPage, step }) => {
      const page = await openAnyPage(PAGE);
      await mountPhoto(page, { src: SRC, backend: 'cpu', light: 'torch' });
      await waitForLoad(page);
      await step('an element moves its torch with the arrow keys when focused', async () => {
        await page.keyboard.press('ArrowLeft');
        expect(await page.evaluate('photo.torch'), 'it has no focus yet').toBeNull();
        await page.keyboard.press('Tab');
        for (let i = 0; i < 5; i += 1) await page.keyboard.press('ArrowLeft');
        await page.keyboard.press('ArrowUp');
        const torch = await page.evaluate('photo.torch');
        expect(torch, JSON.stringify(torch)).toBeTruthy();
        expect(torch.x, JSON.stringify(torch)).toBeLessThan(0.4);
        expect(torch.y, JSON.stringify(torch)).toBeLessThan(0.5);
        const want = nativePicture('torch', { torch });
        expect(await capturePicture(page)).toMatchPicture(want, 1);
      });
      await step(
        'an element keeps its torch at the edge when a drag leaves the picture',
        async () => {
          await page.evaluate("void (photo.style.width = '320px')");
          const at = await pointOf(page);
          await drag(page, at(0.5, 0.5), at(1.4, 0.5));
          const torch = await page.evaluate('photo.torch');
          expect(torch?.x, JSON.stringify(torch)).toBe(1);
          expect(Math.abs(torch.y - 0.5), JSON.stringify(torch)).toBeLessThan(0.01);
        },
      );
    });

    test('encodes its picture in the requested type', async ({ openAnyPage }) => {
      const page = await openAnyPage(PAGE);
      await mountPhoto(page, { src: SRC, backend: backends[0] ?? '' });
      await waitForLoad(page);
      const types = await page.evaluate(async () => {
        const { photo } = /** @type {any} */ (globalThis);
        const blobs = [
          await photo.toBlob(),
          await photo.toBlob({ type: 'image/jpeg', quality: 0.5 }),
        ];
        return blobs.map(({ type, size }) => `${type} ${size > 200}`);
      });
      expect(types).toStrictEqual(['image/png true', 'image/jpeg true']);
    });

    test('contains its picture in boxes of every kind', async ({ openAnyPage, step }) => {
      await checkLayoutBoxes(await openAnyPage(PAGE), step);
    });

    /** @type {[src: string, code: string][]} */
    const faults = [
      ['/photos/absent.ltm', 'http-status'],
      ['/faults/html', 'http-type'],
      ['/faults/cut', 'http-short'],
      ['/photos/not-ltm.ltm', 'format-magic'],
      ['/photos/flipped-tile.ltm', 'format-checksum'],
      ['/photos/truncated.ltm', 'format-truncated'],
    ];
    test('reports errors', async ({ openAnyPage, step }) => {
      const page = await openAnyPage(PAGE);
      for (const [src, code] of faults) {
        await step(`an element reports ${code} for ${src}`, async () => {
          await page.evaluate("document.querySelector('relightable-photo')?.remove()");
          await mountPhoto(page, { src });
          const error = (await waitForEvents(page, 'error')).find(({ type }) => type === 'error');
          expect(error?.['code'], String(error?.['message'])).toBe(code);
          const shown = await page.evaluate(() => {
            const root = document.querySelector('relightable-photo')?.shadowRoot;
            const alert = /** @type {HTMLElement | null} */ (root?.querySelector('[role=alert]'));
            return alert && !alert.hidden ? alert.textContent : null;
          });
          // The details follow a short sentence.
          expect(shown?.endsWith(String(error?.['message'])), String(shown)).toBeTruthy();
          // A correct address loads afterwards.
          await page.evaluate(`void (photo.src = '${SRC}')`);
          await waitForEvents(page, 'load');
        });
      }
    });

    for (const backend of backends) {
      test(`draws on ${backend} next to fifteen others`, async ({ openAnyPage }) => {
        const page = await openAnyPage(PAGE);
        await page.evaluate(
          async ({ src, backend, lights, count }) => {
            await customElements.whenDefined('relightable-photo');
            const loads = Array.from({ length: count }, (_, i) => {
              const photo = document.createElement('relightable-photo');
              const light = lights[i % lights.length];
              const still = { loading: 'eager' };
              Object.assign(photo, { src: `${src}?${i}`, backend, light, ...still });
              Object.assign(photo.style, { width: '64px', float: 'left' });
              const load = new Promise((resolve, reject) => {
                photo.addEventListener('load', resolve);
                photo.addEventListener('error', ({ message }) => reject(new Error(message)));
              });
              photo.pause();
              document.body.append(photo);
              return load;
            });
            await Promise.all(loads);
          },
          { src: SRC, backend, lights: LIGHTS, count: ELEMENTS },
        );
        for (const [i, light] of LIGHTS.entries()) {
          // One of the first and one of the last elements.
          for (const at of [i, ELEMENTS - (ELEMENTS % LIGHTS.length) - LIGHTS.length + i]) {
            const drawn = await pictureOf(page, at);
            const { worst } = compare(drawn, nativePicture(light));
            expect(worst, `element ${at}, ${light}: ${worst}/255`).toBeLessThanOrEqual(1);
          }
        }
        const active = await page.evaluate(
          "[...document.querySelectorAll('relightable-photo')].map((photo) => photo.activeBackend)",
        );
        expect(active).toStrictEqual(Array(ELEMENTS).fill(backend));
      });

      test(`that is removed and added again releases its memory on ${backend}`, async ({
        openAnyPage,
      }) => {
        const page = await openAnyPage(PAGE);
        // Eager: without a screen, Firefox and WebKit may not report the visibility again after a device is destroyed.
        await mountPhoto(page, { src: SRC, backend, light: 'spectrum', loading: 'eager' });
        await waitForLoad(page);
        const growth = await page.evaluate(async (cycles) => {
          const { photo } = /** @type {any} */ (globalThis);
          /** @type {WebAssembly.Memory[]} */
          const memories = /** @type {any} */ (globalThis).memories;
          const bytes = () => memories.reduce((sum, { buffer }) => sum + buffer.byteLength, 0);
          const again = async () => {
            photo.remove();
            await new Promise((resolve) => setTimeout(resolve));
            const load = new Promise((resolve, reject) => {
              photo.addEventListener('load', resolve, { once: true });
              const failed = (/** @type {ErrorEvent} */ { message }) => reject(new Error(message));
              photo.addEventListener('error', failed, { once: true });
            });
            document.body.append(photo);
            await load;
          };
          await again();
          let before = 0;
          // Fragmentation makes a heap grow once in a while, a leak makes it grow in every round.
          for (let round = 0; round < 3; round += 1) {
            before = bytes();
            for (let i = 0; i < cycles; i += 1) await again();
            if (bytes() === before) break;
          }
          return { before, after: bytes(), photo: photo.info.decodedBytes };
        }, CYCLES);
        expect(growth.before, 'the page has WebAssembly memory').toBeGreaterThan(0);
        expect(growth.after - growth.before, JSON.stringify(growth)).toBeLessThan(growth.photo);
        const want = nativePicture('spectrum');
        expect(await capturePicture(page)).toMatchPicture(want, 1);
      });
    }
  });
}

/** The picture of one of several elements, in full quality. @param {AnyPage} page @param {number} index */
async function pictureOf(page, index) {
  const url = await page.evaluate(async (index) => {
    const photo = document.querySelectorAll('relightable-photo')[index];
    const reader = new FileReader();
    reader.readAsDataURL(/** @type {Blob} */ (await photo?.toBlob()));
    await new Promise((resolve) => reader.addEventListener('load', resolve));
    return String(reader.result);
  }, index);
  return decodeDataUrl(url);
}
