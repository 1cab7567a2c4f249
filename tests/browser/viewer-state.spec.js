/** Light and view as attributes, as properties, and as text of `getState`; the picture by `toBlob`. */

import { brightest } from '../../www/tools/pictures.js';
import { expect, test } from './fixtures.js';
import {
  capturePicture,
  countEvents,
  waitForEvents,
  waitForWarning,
  waitUntil,
} from './page-helpers.js';
import { nativePicture } from './test-photos.js';

const GLASS = { src: '/photos/glass.ltm', alt: 'A window', light: 'torch', backend: 'cpu' };

/**
 * @param {import('./fixtures.js').OpenPhoto} openPhoto
 * @param {Record<string, string>} [attributes]
 */
async function open(openPhoto, attributes = {}) {
  const page = await openPhoto({ ...GLASS, ...attributes });
  return page;
}

test.describe('the state', () => {
  test('makes another element show the identical picture', async ({ openPhoto }) => {
    const page = await open(openPhoto);
    await page.evaluate(() => {
      const { photo } = /** @type {any} */ (globalThis);
      photo.setAttribute('zoom', '');
      photo.light = { name: 'torch', x: 1 / 3, y: 0.7, size: 0.3, color: 'orange' };
      photo.exposure = 1.5;
      photo.view = { zoom: 3, x: 0.4, y: 0.5 };
    });
    const want = await capturePicture(page);
    const state = await page.evaluate('photo.getState()');
    expect(state).toBe('l=torch&x=0.3333&y=0.7&r=0.3&c=ffa500&z=3&vx=0.4&vy=0.5&e=1.5');
    const other = await open(openPhoto, { zoom: '4', light: 'stripes' });
    expect(await capturePicture(other)).not.toMatchPicture(want, 0);
    await other.evaluate(`photo.setState('#${state}')`);
    expect(await capturePicture(other)).toMatchPicture(want, 0);
    expect(await other.evaluate('photo.view')).toStrictEqual({ zoom: 3, x: 0.4, y: 0.5 });
    expect(await other.evaluate('photo.getState()')).toBe(state);
    await other.evaluate('photo.reset()');
    expect(await other.evaluate('photo.getState()')).toBe('l=stripes');
    const stripes = nativePicture('stripes');
    expect(await capturePicture(other)).toMatchPicture(stripes, 1);
  });

  test('of several photographs share an address by prefixes', async ({ openPhoto }) => {
    const page = await open(openPhoto, { light: 'fire' });
    expect(await page.evaluate("photo.getState({ prefix: 'a-' })")).toBe('a-l=fire');
    await page.evaluate("photo.setState('?s=window&l=flood&a-l=stripes', { prefix: 'a-' })");
    expect(await page.evaluate('photo.activeLight')).toBe('stripes');
    expect(await countEvents(page, 'warning')).toBe(0);
  });

  test('that is partly invalid applies the rest and causes a warning', async ({ openPhoto }) => {
    const page = await open(openPhoto);
    await page.evaluate("photo.setState('l=torch&x=0.25&y=9&other=1')");
    const warning = await waitForWarning(page);
    expect(warning['code']).toBe('state');
    expect(String(warning['message'])).toMatch(/y=9\. Expected a number from 0 to 1/);
    expect(await page.evaluate('photo.torch')).toStrictEqual({ x: 0.25, y: 0.5 });
  });
});

test.describe('the light', () => {
  test('has the position, size and colour of its attributes', async ({ openPhoto }) => {
    const page = await open(openPhoto, { 'light-x': '0.25', 'light-y': '0.3' });
    const at = { x: 0.25, y: 0.3 };
    expect(await page.evaluate('photo.torch')).toStrictEqual(at);
    const want = nativePicture('torch', { torch: at });
    expect(await capturePicture(page)).toMatchPicture(want, 1);
    const narrow = brightest(await capturePicture(page)).mean;
    const wide = await capturePicture(page, { 'light-size': '0.5' });
    expect(brightest(wide).mean).toBeGreaterThan(1.5 * narrow);
    const red = await capturePicture(page, { 'light-color': 'red' });
    for (let i = 0; i < red.data.length; i += 4) {
      expect([red.data[i + 1], red.data[i + 2]]).toStrictEqual([0, 0]);
      // Dithering and rounding change a code by 1.
      expect(Math.abs((red.data[i] ?? 0) - (wide.data[i] ?? 0))).toBeLessThanOrEqual(1);
    }
    await page.evaluate('photo.torch = { x: 0.9, y: 0.9 }');
    expect(await page.evaluate('photo.lightX'), 'the attribute keeps the page’s value').toBe(0.25);
    await page.evaluate('photo.lightX = 0.5');
    expect(await page.evaluate('photo.torch')).toStrictEqual({ x: 0.5, y: 0.3 });
  });

  test('is the image of light-src, until the visitor chooses a built-in light', async ({
    openPhoto,
  }) => {
    const page = await open(openPhoto, { controls: '', light: 'flood', 'light-src': '/half.png' });
    await page.evaluate("photo.style.width = '400px'");
    await waitForEvents(page, 'lightchange');
    const half = await capturePicture(page);
    const flood = nativePicture('flood');
    expect(brightest(half).x).toBeLessThan(brightest(flood).x - 0.1);
    await page.getByRole('button', { name: 'Light: Projection' }).click();
    await page.getByRole('radio', { name: 'Flood' }).check();
    expect(await capturePicture(page)).toMatchPicture(flood, 1);
    await page.getByRole('radio', { name: 'Projection' }).check();
    expect(await capturePicture(page)).toMatchPicture(half, 0);
    expect(await page.evaluate('photo.light'), 'no script has set it').toBeNull();
    await page.evaluate("photo.lightSrc = '/none.png'");
    expect((await waitForWarning(page))['code']).toBe('light-source');
  });

  test('that is invalid causes no lightchange', async ({ openPhoto }) => {
    const page = await open(openPhoto, { light: 'flood' });
    await page.evaluate(() => {
      const { photo } = /** @type {any} */ (globalThis);
      photo.light = { data: new Float32Array(1), width: 1, height: 1 };
    });
    await waitForWarning(page);
    const changes = () =>
      page.evaluate("photoEvents.filter(({ type }) => type === 'lightchange').length");
    expect(await changes()).toBe(0);
    await page.evaluate(() => {
      const { photo } = /** @type {any} */ (globalThis);
      photo.light = { data: new Float32Array(3), width: 1, height: 1 };
    });
    await waitForEvents(page, 'lightchange');
    await page.evaluate('photo.light = null');
    await waitForEvents(page, 'lightchange', 2);
    expect(await changes()).toBe(2);
  });

  test('is set by name, by position and by source', async ({ openPhoto }) => {
    const page = await open(openPhoto);
    await page.evaluate("photo.light = 'spectrum'");
    const spectrum = nativePicture('spectrum');
    expect(await capturePicture(page)).toMatchPicture(spectrum, 1);
    await page.evaluate("photo.light = { name: 'torch', x: 0.75 }");
    expect(await page.evaluate('photo.torch')).toStrictEqual({ x: 0.75, y: 0.5 });
    await page.evaluate("void (photo.light = document.createElement('canvas'))");
    expect(await page.evaluate('photo.light.localName')).toBe('canvas');
    await page.evaluate('photo.light = null');
    expect(await page.evaluate('photo.light')).toBeNull();
    expect(await page.evaluate('photo.activeLight')).toBe('torch');
    await page.evaluate("photo.light = 'fire', photo.setAttribute('light', 'stripes')");
    expect(await page.evaluate('[photo.light, photo.activeLight]')).toStrictEqual([
      null,
      'stripes',
    ]);
    await expect(page.evaluate("photo.light = 'moon'")).rejects.toThrow(/“moon”/);
  });

  test('keeps its backend when the gamut changes', async ({ openPhoto }) => {
    const page = await open(openPhoto);
    await page.evaluate("photo.gamut = 'display-p3'");
    await waitUntil(page, "photo.activeGamut === 'display-p3'");
    const photoEvents = await waitForEvents(page, 'backendchange');
    expect(photoEvents.filter(({ type }) => type === 'backendchange').length).toBe(1);
  });
});

test.describe('torch and view', () => {
  test('are set in part, and name a field that is no number', async ({ openPhoto }) => {
    const page = await open(openPhoto, { zoom: '4' });
    await page.evaluate('photo.torch = { x: 0.25 }, photo.torch = { y: 0.75 }');
    expect(await page.evaluate('photo.torch')).toStrictEqual({ x: 0.25, y: 0.75 });
    await page.evaluate('photo.view = { zoom: 2 }, photo.view = { x: 0.3 }');
    expect(await page.evaluate('photo.view')).toStrictEqual({ zoom: 2, x: 0.3, y: 0.5 });
    for (const [assignment, message] of /** @type {const} */ ([
      ['photo.torch = { x: "left" }', /TypeError: torch\.x must be a finite number, but is left/],
      ['photo.view = { zoom: NaN }', /TypeError: view\.zoom must be a finite number/],
      ['photo.view = null', /TypeError: view must be an object with zoom, x, y/],
      ['photo.light = { size: Infinity }', /TypeError: light\.size must be a finite number/],
      ['photo.viewTo({ zoom: 2 }, { duration: -1 })', /TypeError: duration must be/],
    ])) {
      await expect(page.evaluate(assignment)).rejects.toThrow(message);
    }
    expect(await page.evaluate('photo.torch')).toStrictEqual({ x: 0.25, y: 0.75 });
    await page.evaluate("photo.removeAttribute('zoom'), photo.view = { zoom: 2 }");
    expect((await waitForWarning(page))['message']).toContain('set the zoom attribute');
  });

  test('move to their place, and stay where a visitor interferes', async ({ openPhoto }) => {
    const page = await open(openPhoto, { zoom: '4' });
    const trace = await page.evaluate(async () => {
      const { photo } = /** @type {any} */ (globalThis);
      /** @type {number[][]} */
      const trace = [];
      photo.torch = { x: 0, y: 0.5 };
      photo.addEventListener('lightchange', () => trace.push([photo.torch.x, photo.view.zoom]));
      const view = photo.viewTo({ zoom: 4, x: 0.5 }, { duration: 400 });
      await photo.lightTo({ name: 'torch', x: 1 }, { duration: 400 });
      await view;
      return [...trace, [photo.torch.x, photo.view.zoom]];
    });
    expect(trace.at(-1)).toStrictEqual([1, 4]);
    const between = trace.filter(([x = 0, zoom = 0]) => x > 0 && x < 1 && zoom > 1 && zoom < 4);
    expect(between.length).toBeGreaterThan(2);
    const isSorted = trace.every(([x = 0], i) => i === 0 || x >= (trace[i - 1]?.[0] ?? 0));
    expect(isSorted, 'the torch moves one way').toBe(true);
    const end = await page.evaluate(async () => {
      const { photo } = /** @type {any} */ (globalThis);
      const moved = photo.lightTo({ name: 'torch', x: 0 }, { duration: 1e6 });
      await new Promise(requestAnimationFrame);
      photo.torch = { x: 0.5 };
      await moved;
      return photo.torch.x;
    });
    expect(end).toBe(0.5);
    await page.emulateMedia({ reducedMotion: 'reduce' });
    await page.evaluate("photo.lightTo({ name: 'torch', x: 0.125 }, { duration: 1e6 })");
    expect(await page.evaluate('photo.torch.x')).toBe(0.125);
  });
});

test.describe('a light that moves', () => {
  test('gives way to every later choice', async ({ openPhoto }) => {
    const page = await open(openPhoto, { controls: '' });
    const move = "photo.lightTo({ name: 'torch', x: 1 }, { duration: 1e6 })";
    // Later, but before the motion begins.
    await page.evaluate(`Promise.all([${move}, photo.light = 'spectrum'])`);
    expect(await page.evaluate('photo.activeLight')).toBe('spectrum');
    for (const choice of [
      "photo.setAttribute('light', 'fire')",
      "photo.shadowRoot.querySelector('input[value=fire]').click()",
    ]) {
      await page.evaluate(`(async () => {
        photo.light = 'flood';
        const moved = ${move};
        await new Promise(requestAnimationFrame);
        ${choice};
        await moved;
      })()`);
      expect(await page.evaluate('photo.activeLight')).toBe('fire');
    }
  });

  test('is at its end once nobody sees it', async ({ openPhoto }) => {
    const page = await open(openPhoto);
    const moved = page.evaluate("photo.lightTo({ name: 'torch', x: 1 }, { duration: 1e6 })");
    await page.evaluate("photo.style.marginTop = '5000px'");
    await moved;
    expect(await page.evaluate('photo.torch.x')).toBe(1);
  });
});

test.describe('toBlob', () => {
  test('scales the picture', async ({ openPhoto }) => {
    const page = await open(openPhoto);
    /** @param {number} scale */
    const sizeAt = (scale) =>
      page.evaluate(async (scale) => {
        const { photo } = /** @type {any} */ (globalThis);
        const bitmap = await createImageBitmap(await photo.toBlob({ scale, type: 'image/jpeg' }));
        return [bitmap.width, bitmap.height];
      }, scale);
    const { width, height } = await page.evaluate('photo.info');
    expect(await sizeAt(0.5)).toStrictEqual([width / 2, height / 2]);
    expect(await sizeAt(2)).toStrictEqual([2 * width, 2 * height]);
    await expect(sizeAt(0)).rejects.toThrow(/RangeError/);
    await expect(sizeAt(5)).rejects.toThrow(/at most 4/);
  });
});
