/** Light and view by properties, by `setLight`, and as text. */

import assert from 'node:assert/strict';
import { describe, test } from 'node:test';
import { brightest, compare } from '../../www/tools/pictures.js';
import { happenedUntil, loaded, mount, openPage, picture } from './browser.js';
import { nativePicture } from './photos.js';

const GLASS = { src: '/photos/glass.ltm', alt: 'A window', light: 'torch', backend: 'cpu' };

/** @param {import('node:test').TestContext} t @param {Record<string, string>} [attributes] */
async function opened(t, attributes = {}) {
  const page = await openPage(t, '/bench');
  await mount(page, { ...GLASS, ...attributes });
  await loaded(page);
  return page;
}

describe('a state', () => {
  test('makes another element look the same, to the pixel', async (t) => {
    const page = await opened(t);
    await page.evaluate(() => {
      const { photo } = /** @type {any} */ (globalThis);
      photo.setAttribute('zoom', '');
      photo.setLight({ name: 'torch', x: 1 / 3, y: 0.7, size: 0.3, color: 'orange' });
      photo.exposure = 1.5;
      photo.view = { zoom: 3, x: 0.4, y: 0.5 };
    });
    const want = await picture(page);
    const state = await page.evaluate('photo.getState()');
    assert.equal(state, 'l=torch&x=0.3333&y=0.7&s=0.3&c=ffa500&z=3&vx=0.4&vy=0.5&e=1.5');
    const other = await opened(t, { zoom: '4', light: 'stripes' });
    assert.notEqual(compare(await picture(other), want).worst, 0);
    await other.evaluate(`photo.setState('#${state}')`);
    assert.equal(compare(await picture(other), want).worst, 0);
    assert.deepEqual(await other.evaluate('photo.view'), { zoom: 3, x: 0.4, y: 0.5 });
    assert.equal(await other.evaluate('photo.getState()'), state);
    await other.evaluate('photo.reset()');
    assert.equal(await other.evaluate('photo.getState()'), 'l=stripes');
    const stripes = nativePicture('stripes', 'reference');
    assert.ok(compare(await picture(other), stripes).worst <= 1);
  });

  test('that is partly wrong does the rest, and tells', async (t) => {
    const page = await opened(t);
    await page.evaluate("photo.setState('l=torch&x=0.25&y=9&other=1')");
    const happened = await happenedUntil(page, 'error');
    const error = happened.find(({ type }) => type === 'error');
    assert.equal(error?.['code'], 'state');
    assert.match(String(error?.['message']), /y=9, where y is a number from 0 to 1/);
    assert.deepEqual(await page.evaluate('photo.torch'), { x: 0.25, y: 0.5 });
  });
});

describe('the light', () => {
  test('is where attributes say, as wide and of the colour that they say', async (t) => {
    const page = await opened(t, { 'light-x': '0.25', 'light-y': '0.3' });
    const at = { x: 0.25, y: 0.3 };
    assert.deepEqual(await page.evaluate('photo.torch'), at);
    const want = nativePicture('torch', 'reference', 1, at);
    assert.ok(compare(await picture(page), want).worst <= 1);
    const narrow = brightest(await picture(page)).mean;
    const wide = await picture(page, { 'light-size': '0.5' });
    assert.ok(brightest(wide).mean > 1.5 * narrow);
    const red = await picture(page, { 'light-color': 'red' });
    for (let i = 0; i < red.data.length; i += 4) {
      assert.deepEqual([red.data[i + 1], red.data[i + 2]], [0, 0]);
      // Dithering and rounding.
      assert.ok(Math.abs((red.data[i] ?? 0) - (wide.data[i] ?? 0)) <= 1);
    }
    await page.evaluate('photo.torch = { x: 0.9, y: 0.9 }');
    assert.equal(await page.evaluate('photo.lightX'), 0.25, 'the attribute is the page’s');
    await page.evaluate('photo.lightX = 0.5');
    assert.deepEqual(await page.evaluate('photo.torch'), { x: 0.5, y: 0.3 });
  });

  test('is a picture by its address, and a built-in one where somebody chooses that', async (t) => {
    const page = await opened(t, { controls: '', light: 'flood', 'light-src': '/half.png' });
    await page.evaluate("photo.style.width = '400px'");
    await happenedUntil(page, 'lightchange');
    const half = await picture(page);
    const flood = nativePicture('flood', 'reference');
    assert.ok(brightest(half).x < brightest(flood).x - 0.1);
    await page.getByRole('button', { name: 'Light: Projection' }).click();
    await page.getByRole('radio', { name: 'Flood' }).check();
    assert.ok(compare(await picture(page), flood).worst <= 1);
    await page.getByRole('radio', { name: 'Projection' }).check();
    assert.equal(compare(await picture(page), half).worst, 0);
    assert.equal(await page.evaluate('photo.lightSource'), null, 'no script has set one');
    await page.evaluate("photo.lightSrc = '/none.png'");
    const errors = await happenedUntil(page, 'error');
    assert.equal(errors.find(({ type }) => type === 'error')?.['code'], 'light-source');
  });

  test('that is refused is no change', async (t) => {
    const page = await opened(t, { light: 'flood' });
    await page.evaluate(() => {
      const { photo } = /** @type {any} */ (globalThis);
      photo.lightSource = { data: new Float32Array(1), width: 1, height: 1 };
    });
    await happenedUntil(page, 'error');
    const changes = () =>
      page.evaluate("happened.filter(({ type }) => type === 'lightchange').length");
    assert.equal(await changes(), 0);
    await page.evaluate(() => {
      const { photo } = /** @type {any} */ (globalThis);
      photo.lightSource = { data: new Float32Array(3), width: 1, height: 1 };
    });
    await happenedUntil(page, 'lightchange');
    await page.evaluate('photo.setLight(null)');
    await happenedUntil(page, 'lightchange', 2);
    assert.equal(await changes(), 2);
  });

  test('is set by name, by place, by source', async (t) => {
    const page = await opened(t);
    await page.evaluate("photo.setLight('spectrum')");
    const spectrum = nativePicture('spectrum', 'reference');
    assert.ok(compare(await picture(page), spectrum).worst <= 1);
    await page.evaluate("photo.setLight({ name: 'torch', x: 0.75 })");
    assert.deepEqual(await page.evaluate('photo.torch'), { x: 0.75, y: 0.5 });
    await page.evaluate("photo.setLight(document.createElement('canvas'))");
    assert.equal(await page.evaluate('photo.lightSource.localName'), 'canvas');
    await page.evaluate('photo.setLight(null)');
    assert.equal(await page.evaluate('photo.lightSource'), null);
    await assert.rejects(page.evaluate("photo.setLight('moon')"), /“moon”/);
  });

  test('changes without a new back end where its gamut does', async (t) => {
    const page = await opened(t);
    await page.evaluate("photo.gamut = 'display-p3'");
    await page.waitForFunction("photo.activeGamut === 'display-p3'");
    const happened = await happenedUntil(page, 'backendchange');
    assert.equal(happened.filter(({ type }) => type === 'backendchange').length, 1);
  });
});

describe('toBlob', () => {
  test('scales', async (t) => {
    const page = await opened(t);
    /** @param {number} scale */
    const sizeAt = (scale) =>
      page.evaluate(async (scale) => {
        const { photo } = /** @type {any} */ (globalThis);
        const bitmap = await createImageBitmap(await photo.toBlob({ scale, type: 'image/jpeg' }));
        return [bitmap.width, bitmap.height];
      }, scale);
    const { width, height } = await page.evaluate('photo.info');
    assert.deepEqual(await sizeAt(0.5), [width / 2, height / 2]);
    assert.deepEqual(await sizeAt(2), [2 * width, 2 * height]);
    await assert.rejects(sizeAt(0), /RangeError/);
    await assert.rejects(sizeAt(5), /at most 4/);
  });
});
