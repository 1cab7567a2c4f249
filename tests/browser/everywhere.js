/** What has to hold in every browser, under the strictest policy that the element is made to live under. */

import assert from 'node:assert/strict';
import { describe, test } from 'node:test';
import { compare, decodePng } from '../../www/tools/pictures.js';
import { happenedUntil, loaded, mount, picture } from './browser.js';
import { LIGHTS, nativePicture } from './photos.js';

/** @typedef {import('./any-browser.js').AnyPage} AnyPage */
/** @typedef {import('./any-browser.js').AnyBrowser} AnyBrowser */

const PAGE = '/strictest';
const SRC = '/photos/glass.ltm';
const ELEMENTS = 16;
const CYCLES = 10;

/** Where the element is on the page. @param {AnyPage} page */
async function placeOf(page) {
  const { left, top, width, height } = await page.evaluate(
    "(({ left, top, width, height }) => ({ left, top, width, height }))(document.querySelector('relightable-photo').getBoundingClientRect())",
  );
  return (/** @type {number} */ x, /** @type {number} */ y) => ({
    x: left + x * width,
    y: top + y * height,
  });
}

/** @param {AnyPage} page */
async function onScreen(page) {
  return decodePng(await page.locator('relightable-photo').screenshot());
}

/** @param {() => Promise<boolean>} condition @param {string} what */
async function eventually(condition, what) {
  for (let i = 0; i < 100; i += 1) {
    if (await condition()) return;
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
  assert.fail(`never came: ${what}`);
}

/** Whether red or blue prevails in a picture. @param {import('../../www/tools/pictures.js').Picture} picture */
function colourOf({ data }) {
  let [red, blue] = [0, 0];
  for (let at = 0; at < data.length; at += 4) {
    red += data[at] ?? 0;
    blue += data[at + 2] ?? 0;
  }
  return red > 2 * blue ? 'red' : blue > 2 * red ? 'blue' : 'neither';
}

/**
 * @param {AnyBrowser} browser
 * @param {object} has
 * @param {readonly string[]} has.backends that the browser has here
 * @param {readonly string[]} has.missing those it has not
 * @param {boolean} has.screenshots whether they show what is on the screen
 * @param {boolean} has.namesGpus whether it tells a GPU from a program
 */
export function testsIn(browser, { backends, missing, screenshots, namesGpus }) {
  describe('relighting', () => {
    for (const backend of backends) {
      test(`${backend} draws what the native program draws, to 1/255`, async (t) => {
        const page = await browser.open(t, PAGE);
        await mount(page, { src: SRC, backend });
        const happened = await loaded(page);
        const change = happened.find((event) => event.type === 'backendchange');
        assert.deepEqual(change, { type: 'backendchange', backend, previous: null, reason: '' });
        t.diagnostic(`drawn by ${await page.evaluate('photo.kernel')}`);
        for (const light of LIGHTS) {
          const want = nativePicture(light, 'reference');
          const { worst, psnr } = compare(await picture(page, { light }), want);
          t.diagnostic(`${light}: worst ${worst}/255, ${psnr.toFixed(1)} dB`);
          assert.ok(worst <= 1, `${light} differs by ${worst}/255`);
        }
        const want = nativePicture('spectrum', 'reference', 2.5);
        const bright = await picture(page, { light: 'spectrum', exposure: '2.5' });
        assert.ok(compare(bright, want).worst <= 1, 'the exposure');
        // The screen may round once more.
        if (screenshots) assert.ok(compare(await onScreen(page), want).worst <= 2, 'on the screen');
      });

      test(`the torch follows the pointer on ${backend}`, async (t) => {
        const page = await browser.open(t, PAGE);
        await mount(page, { src: SRC, backend, light: 'torch' });
        await loaded(page);
        await page.evaluate("void (photo.style.width = '320px')");
        const place = await placeOf(page);
        for (const [x, y] of /** @type {const} */ ([
          [0.25, 0.3],
          [0.75, 0.7],
        ])) {
          const point = place(x, y);
          await page.mouse.move(point.x, point.y);
          const torch = await page.evaluate('photo.torch');
          assert.ok(torch, 'the torch is not held');
          assert.ok(Math.abs(torch.x - x) < 0.01 && Math.abs(torch.y - y) < 0.01);
          const want = nativePicture('torch', 'reference', 1, torch);
          assert.ok(compare(await picture(page), want).worst <= 1);
        }
      });

      test(`a canvas and a film light on ${backend}`, async (t) => {
        const page = await browser.open(t, PAGE);
        await mount(page, { src: SRC, backend, light: 'flood' });
        await loaded(page);
        await page.evaluate(() => {
          const canvas = Object.assign(document.createElement('canvas'), { width: 40, height: 30 });
          const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
          context.fillStyle = 'rgb(255 255 255 / 0.2)';
          context.fillRect(0, 0, 40, 30);
          /** @type {any} */ (globalThis).photo.lightSource = canvas;
        });
        const fifth = nativePicture('flood', 'reference', 0.2);
        assert.ok(compare(await picture(page), fifth).worst <= 1, 'the canvas');
        await page.evaluate(async () => {
          const video = document.createElement('video');
          Object.assign(video, { muted: true, playsInline: true, src: '/film.webm' });
          Object.assign(globalThis, { video });
          /** @type {any} */ (globalThis).photo.lightSource = video;
        });
        const colour = async () => colourOf(await (screenshots ? onScreen(page) : picture(page)));
        await eventually(async () => (await colour()) === 'red', 'the red of the film');
        await page.evaluate('video.play()');
        await eventually(async () => (await colour()) === 'blue', 'the blue of the film');
      });
    }

    for (const backend of missing) {
      test(`without ${backend} the next back end draws, and says why`, async (t) => {
        const page = await browser.open(t, PAGE);
        await mount(page, { src: SRC, light: 'spectrum', backend: `${backend} ${backends[0]}` });
        const happened = await loaded(page);
        const change = happened.find((event) => event.type === 'backendchange');
        assert.equal(change?.['backend'], backends[0]);
        assert.match(String(change?.['reason']), /\w+: \S+ \S+/);
        const want = nativePicture('spectrum', 'reference');
        assert.ok(compare(await picture(page), want).worst <= 1);
      });
    }

    const unnamed = namesGpus ? false : 'the browser does not tell what its GPU is';
    test('a program that makes up for a GPU is not taken unless it is asked for', {
      skip: unnamed,
    }, async (t) => {
      const page = await browser.open(t, PAGE);
      await mount(page, { src: SRC });
      const change = (await loaded(page)).find((event) => event.type === 'backendchange');
      assert.equal(change?.['backend'], 'cpu', await page.evaluate('photo.kernel'));
      t.diagnostic(String(change?.['reason']));
    });

    test('workers decode and relight', async (t) => {
      const page = await browser.open(t, PAGE);
      await mount(page, { src: SRC, backend: 'cpu' });
      await loaded(page);
      assert.match(await page.evaluate('photo.kernel'), /^simd128, \d workers?$/);
      /** @type {{ url: string, answers: number, failed: boolean }[]} */
      const workers = await page.evaluate('workers');
      for (const name of ['worker', 'relighter']) {
        const some = workers.filter(({ url }) => url.endsWith(`relightable-photo-${name}.js`));
        assert.ok(some.length > 0, `no ${name}`);
        assert.ok(!some.some(({ failed }) => failed), `a ${name} failed`);
        // The first answer says that it is up, the next ones that it works. Small photographs need one only.
        assert.ok(
          some.some(({ answers }) => answers > 1),
          `no ${name} at work`,
        );
      }
    });
  });

  describe('an element', () => {
    test('has its torch moved by the arrow keys, once focused', async (t) => {
      const page = await browser.open(t, PAGE);
      await mount(page, { src: SRC, backend: 'cpu', light: 'torch' });
      await loaded(page);
      await page.keyboard.press('ArrowLeft');
      assert.equal(await page.evaluate('photo.torch'), null, 'it was not focused yet');
      await page.keyboard.press('Tab');
      for (let i = 0; i < 5; i += 1) await page.keyboard.press('ArrowLeft');
      await page.keyboard.press('ArrowUp');
      const torch = await page.evaluate('photo.torch');
      assert.ok(torch && torch.x < 0.4 && torch.y < 0.5, JSON.stringify(torch));
      const want = nativePicture('torch', 'reference', 1, torch);
      assert.ok(compare(await picture(page), want).worst <= 1);
    });

    test('keeps its torch at the edge when a drag leaves the picture', async (t) => {
      const page = await browser.open(t, PAGE);
      await mount(page, { src: SRC, backend: 'cpu', light: 'torch' });
      await loaded(page);
      await page.evaluate("void (photo.style.width = '320px')");
      const place = await placeOf(page);
      const [from, to] = [place(0.5, 0.5), place(1.4, 0.5)];
      await page.mouse.move(from.x, from.y);
      await page.mouse.down();
      await page.mouse.move(to.x, to.y);
      await page.mouse.up();
      const torch = await page.evaluate('photo.torch');
      assert.ok(torch?.x === 1 && Math.abs(torch.y - 0.5) < 0.01, JSON.stringify(torch));
    });

    test('gives its picture as a file of the type that is asked for', async (t) => {
      const page = await browser.open(t, PAGE);
      await mount(page, { src: SRC, backend: backends[0] ?? '' });
      await loaded(page);
      const types = await page.evaluate(async () => {
        const { photo } = /** @type {any} */ (globalThis);
        const blobs = [
          await photo.toBlob(),
          await photo.toBlob({ type: 'image/jpeg', quality: 0.5 }),
        ];
        return blobs.map(({ type, size }) => `${type} ${size > 200}`);
      });
      assert.deepEqual(types, ['image/png true', 'image/jpeg true']);
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
    for (const [src, code] of faults) {
      test(`given ${src} says ${code}`, async (t) => {
        const page = await browser.open(t, PAGE);
        await mount(page, { src });
        const error = (await happenedUntil(page, 'error')).find(({ type }) => type === 'error');
        assert.equal(error?.['code'], code, String(error?.['message']));
        const shown = await page.evaluate(() => {
          const root = document.querySelector('relightable-photo')?.shadowRoot;
          const alert = /** @type {HTMLElement | null} */ (root?.querySelector('[role=alert]'));
          return alert && !alert.hidden ? alert.textContent : null;
        });
        // Below what visitors read.
        assert.ok(shown?.endsWith(String(error?.['message'])), String(shown));
        // It loads what is right afterwards.
        await page.evaluate(`void (photo.src = '${SRC}')`);
        await happenedUntil(page, 'load');
      });
    }

    for (const backend of backends) {
      test(`and fifteen others on a page all draw on ${backend}`, async (t) => {
        const page = await browser.open(t, PAGE);
        await page.evaluate(
          async ({ src, backend, lights, count }) => {
            await customElements.whenDefined('relightable-photo');
            const loads = Array.from({ length: count }, (_, i) => {
              const photo = document.createElement('relightable-photo');
              const light = lights[i % lights.length];
              const still = { loading: 'eager', paused: true };
              Object.assign(photo, { src: `${src}?${i}`, backend, light, ...still });
              Object.assign(photo.style, { width: '64px', float: 'left' });
              const load = new Promise((resolve, reject) => {
                photo.addEventListener('load', resolve);
                photo.addEventListener('error', ({ message }) => reject(new Error(message)));
              });
              document.body.append(photo);
              return load;
            });
            await Promise.all(loads);
          },
          { src: SRC, backend, lights: LIGHTS, count: ELEMENTS },
        );
        for (const [i, light] of LIGHTS.entries()) {
          // Of the first ones and of the last ones.
          for (const at of [i, ELEMENTS - (ELEMENTS % LIGHTS.length) - LIGHTS.length + i]) {
            const drawn = await pictureOf(page, at);
            const { worst } = compare(drawn, nativePicture(light, 'reference'));
            assert.ok(worst <= 1, `element ${at}, ${light}: ${worst}/255`);
          }
        }
        const active = await page.evaluate(
          "[...document.querySelectorAll('relightable-photo')].map((photo) => photo.activeBackend)",
        );
        assert.deepEqual(active, Array(ELEMENTS).fill(backend));
      });

      test(`removed and put back leaves no memory behind on ${backend}`, async (t) => {
        const page = await browser.open(t, PAGE);
        // Not once it is seen: without a screen, Firefox and WebKit may not look again once a device is gone.
        await mount(page, { src: SRC, backend, light: 'spectrum', loading: 'eager' });
        await loaded(page);
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
          // Now and then a heap grows by what does not fit its gaps; by what leaks it grows always.
          for (let round = 0; round < 3; round += 1) {
            before = bytes();
            for (let i = 0; i < cycles; i += 1) await again();
            if (bytes() === before) break;
          }
          return { before, after: bytes(), photo: photo.info.decodedBytes };
        }, CYCLES);
        assert.ok(growth.before > 0, 'no memory was seen');
        assert.ok(growth.after - growth.before < growth.photo, JSON.stringify(growth));
        const want = nativePicture('spectrum', 'reference');
        assert.ok(compare(await picture(page), want).worst <= 1);
      });
    }
  });
}

/** The exact picture of one of many elements. @param {AnyPage} page @param {number} index */
async function pictureOf(page, index) {
  const url = await page.evaluate(async (index) => {
    const photo = document.querySelectorAll('relightable-photo')[index];
    const reader = new FileReader();
    reader.readAsDataURL(/** @type {Blob} */ (await photo?.toBlob()));
    await new Promise((resolve) => reader.addEventListener('load', resolve));
    return String(reader.result);
  }, index);
  return decodePng(Buffer.from(url.slice(url.indexOf(',') + 1), 'base64'));
}
