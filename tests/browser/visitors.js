/** What visitors do with a mouse, fingers and keys, beyond moving the torch. */

import assert from 'node:assert/strict';
import { describe, test } from 'node:test';
import { compare } from '../../www/tools/pictures.js';
import { happenedUntil, loaded, mount, openPage, picture } from './browser.js';

/** @typedef {import('playwright-core').Page} Page */
/** @typedef {import('node:test').TestContext} TestContext */

const GLASS = { src: '/photos/glass.ltm', alt: 'A window', light: 'torch', backend: 'cpu' };

/**
 * A page with a large element in it, and where its places are on the screen.
 *
 * @param {TestContext} t
 * @param {Record<string, string>} attributes
 * @param {import('playwright-core').BrowserContextOptions} [options]
 */
async function visit(t, attributes, options) {
  const page = await openPage(t, '/bench', options);
  await mount(page, { ...GLASS, ...attributes });
  await page.evaluate("photo.style.width = '320px'");
  await loaded(page);
  await page.waitForFunction('photo.detail === 1');
  const box = await page.locator('relightable-photo').boundingBox();
  assert.ok(box);
  const at = (/** @type {number} */ x, /** @type {number} */ y) => ({
    x: box.x + x * box.width,
    y: box.y + y * box.height,
  });
  return { page, at };
}

/** @param {Page} page */
const viewOf = async (page) =>
  /** @type {import('../../www/src/index.js').PhotoView} */ (await page.evaluate('photo.view'));

/** @param {Page} page */
const torchOf = async (page) =>
  /** @type {import('../../www/src/index.js').PicturePoint | null} */ (
    await page.evaluate('photo.torch')
  );

/**
 * Fingers on the screen, as the browser gets them from it.
 *
 * @param {Page} page
 */
async function fingers(page) {
  const session = await page.context().newCDPSession(page);
  return (
    /** @type {'touchStart' | 'touchMove' | 'touchEnd'} */ type,
    /** @type {{ x: number, y: number }[]} */ ...points
  ) =>
    session.send('Input.dispatchTouchEvent', {
      type,
      touchPoints: points.map((point, id) => ({ ...point, id })),
    });
}

const TOUCH = { hasTouch: true, viewport: { width: 400, height: 600 } };

describe('zooming', () => {
  test('by the wheel holds what is under the pointer, and leaves the light', async (t) => {
    const { page, at } = await visit(t, { zoom: '' });
    const point = at(0.25, 0.75);
    await page.mouse.move(point.x, point.y);
    for (let i = 0; i < 4; i += 1) await page.mouse.wheel(0, -120);
    await page.waitForFunction('Math.abs(photo.view.zoom - 4) < 0.01');
    const { zoom, x, y } = await viewOf(page);
    const seen = { x: x + (0.25 - 0.5) / zoom, y: y + (0.75 - 0.5) / zoom };
    assert.ok(Math.abs(seen.x - 0.25) < 2e-3 && Math.abs(seen.y - 0.75) < 2e-3);
    assert.deepEqual(await torchOf(page), { x: 0.25, y: 0.75 });
    const told = (await happenedUntil(page, 'viewchange')).findLast((e) => e.type === 'viewchange');
    assert.deepEqual(told, { type: 'viewchange', zoom, x, y });
    const canvas = page.locator('relightable-photo canvas');
    const { width = 0 } = (await canvas.boundingBox()) ?? {};
    assert.ok(Math.abs(width - zoom * 320) < 1, String(width));
    // What the mouse points at is where the light goes, also in a part.
    const corner = at(1, 0);
    await page.mouse.move(corner.x - 1, corner.y + 1);
    const torch = await torchOf(page);
    assert.ok(torch && Math.abs(torch.x - (x + 0.5 / zoom)) < 0.01);
    assert.ok(torch && Math.abs(torch.y - (y - 0.5 / zoom)) < 0.01);
  });

  test('lets the page scroll at its end, and nobody without it', async (t) => {
    const { page, at } = await visit(t, { zoom: '2' });
    await page.evaluate(
      "document.body.insertAdjacentHTML('beforeend', '<p style=\"height: 3000px\">')",
    );
    const point = at(0.5, 0.5);
    await page.mouse.move(point.x, point.y);
    for (let i = 0; i < 2; i += 1) await page.mouse.wheel(0, -120);
    await page.waitForFunction('photo.view.zoom === 2');
    assert.equal(await page.evaluate('scrollY'), 0);
    for (let i = 0; i < 4; i += 1) await page.mouse.wheel(0, 120);
    await page.waitForFunction('photo.view.zoom === 1 && scrollY > 0');
    await page.evaluate("scrollTo(0, 0), photo.removeAttribute('zoom')");
    await page.mouse.wheel(0, 120);
    await page.waitForFunction('scrollY > 0');
  });

  test('leaves the wheel to the page where gestures are cooperative, and says how', async (t) => {
    const { page, at } = await visit(t, { zoom: '', 'cooperative-gestures': '' });
    await page.evaluate(
      "document.body.insertAdjacentHTML('beforeend', '<p style=\"height: 3000px\">')",
    );
    const point = at(0.5, 0.5);
    await page.mouse.move(point.x, point.y);
    await page.mouse.wheel(0, 60);
    await page.waitForFunction('scrollY > 0');
    await page.getByText('Ctrl + scroll to zoom').waitFor({ state: 'visible' });
    await page.getByText('Ctrl + scroll to zoom').waitFor({ state: 'hidden' });
    await page.evaluate('scrollTo(0, 0)');
    await page.keyboard.down('Control');
    await page.mouse.wheel(0, -120);
    await page.keyboard.up('Control');
    await page.waitForFunction('photo.view.zoom > 1.2');
    assert.equal(await page.evaluate('scrollY'), 0);
  });

  test('by two fingers leaves the light where it was', async (t) => {
    const { page, at } = await visit(t, { zoom: '', 'light-x': '0.9' }, TOUCH);
    const touch = await fingers(page);
    await touch('touchStart', at(0.4, 0.5));
    assert.equal((await torchOf(page))?.x, 0.4);
    await touch('touchStart', at(0.4, 0.5), at(0.6, 0.5));
    await touch('touchMove', at(0.3, 0.5), at(0.7, 0.5));
    await touch('touchMove', at(0.2, 0.6), at(0.8, 0.6));
    await touch('touchEnd');
    const { zoom, y } = await viewOf(page);
    assert.ok(Math.abs(zoom - 3) < 0.1, String(zoom));
    assert.ok(y < 0.5, 'the picture went down with the fingers');
    assert.deepEqual(await torchOf(page), { x: 0.9, y: 0.5 });
  });

  test('by two taps, or two clicks, goes closer and back', async (t) => {
    const { page, at } = await visit(t, { zoom: '' }, TOUCH);
    const point = at(0.25, 0.25);
    const twice = async () => {
      await page.touchscreen.tap(point.x, point.y);
      await page.touchscreen.tap(point.x, point.y);
    };
    await twice();
    assert.equal((await viewOf(page)).zoom, 2.5);
    await page.waitForTimeout(400);
    await twice();
    assert.deepEqual(await viewOf(page), { zoom: 1, x: 0.5, y: 0.5 });
    await page.waitForTimeout(400);
    await page.mouse.dblclick(point.x, point.y);
    assert.equal((await viewOf(page)).zoom, 2.5);
  });

  test('by a script stays within what is allowed', async (t) => {
    const { page } = await visit(t, { zoom: '4' });
    await page.evaluate('photo.view = { zoom: 100, x: 0, y: 0.5 }');
    assert.deepEqual(await viewOf(page), { zoom: 4, x: 0.125, y: 0.5 });
    await page.evaluate("photo.removeAttribute('zoom')");
    await happenedUntil(page, 'viewchange', 2);
    assert.deepEqual(await viewOf(page), { zoom: 1, x: 0.5, y: 0.5 });
    await assert.rejects(page.evaluate('photo.view = { zoom: 2 }'), /finite numbers/);
  });

  test('pans by Shift, by the middle button and by Space, and never without being zoomed', async (t) => {
    const { page, at } = await visit(t, { zoom: '' });
    const [from, to] = [at(0.5, 0.5), at(0.6, 0.5)];
    const drag = async (/** @type {'left' | 'middle'} */ button) => {
      await page.mouse.move(from.x, from.y);
      await page.mouse.down({ button });
      await page.mouse.move(to.x, to.y);
      await page.mouse.up({ button });
      return (await viewOf(page)).x;
    };
    const begin = 'photo.view = { zoom: 2, x: 0.5, y: 0.5 }';
    await page.evaluate(begin);
    await page.keyboard.down('Shift');
    assert.ok(Math.abs((await drag('left')) - 0.45) < 1e-3);
    await page.keyboard.up('Shift');
    await page.evaluate(begin);
    assert.ok(Math.abs((await drag('middle')) - 0.45) < 1e-3);
    await page.evaluate(begin);
    // The picture has the focus by now.
    await page.keyboard.down(' ');
    assert.ok(Math.abs((await drag('left')) - 0.45) < 1e-3);
    await page.keyboard.up(' ');
    await page.evaluate(begin);
    assert.equal(await drag('left'), 0.5, 'the light is taken along');
    assert.ok((await torchOf(page))?.x !== 0.5);
    await page.evaluate("photo.light = 'flood'");
    assert.ok(Math.abs((await drag('left')) - 0.45) < 1e-3, 'no light to take along');
    await page.evaluate('photo.view = { zoom: 1, x: 0.5, y: 0.5 }');
    assert.equal(await drag('left'), 0.5);
  });
});

describe('a finger', () => {
  test('lets the page scroll up and down, also with two of them where there is no zoom', async (t) => {
    const { page, at } = await visit(t, {}, TOUCH);
    await page.evaluate(
      "document.body.insertAdjacentHTML('beforeend', '<p style=\"height: 3000px\">')",
    );
    const touch = await fingers(page);
    await touch('touchStart', at(0.5, 0.9));
    for (let i = 1; i <= 8; i += 1) await touch('touchMove', at(0.5, 0.9 - 0.1 * i));
    await touch('touchEnd');
    await page.waitForFunction('scrollY > 50');
  });

  test('that lets go in motion throws the light, unless less motion is asked for', async (t) => {
    for (const reducedMotion of /** @type {const} */ (['no-preference', 'reduce'])) {
      const { page, at } = await visit(t, { zoom: '' }, { ...TOUCH, reducedMotion });
      const touch = await fingers(page);
      await touch('touchStart', at(0.1, 0.5));
      for (let i = 1; i <= 4; i += 1) await touch('touchMove', at(0.1 + 0.05 * i, 0.5));
      await touch('touchEnd');
      if (reducedMotion === 'reduce') {
        await page.waitForTimeout(300);
        assert.equal((await torchOf(page))?.x, 0.3);
      } else {
        await page.waitForFunction('photo.torch.x > 0.32');
      }
    }
  });
});

describe('the keyboard', () => {
  test('moves the light by large steps and to the sides, and lets go', async (t) => {
    const { page } = await visit(t, {});
    await page.keyboard.press('ArrowLeft');
    assert.equal(await torchOf(page), null, 'without the focus, keys are the page’s');
    await page.keyboard.press('Tab');
    const slider = page.getByRole('slider', { name: 'Light' });
    const press = async (/** @type {string} */ key) => {
      await page.keyboard.press(key);
      return torchOf(page);
    };
    assert.deepEqual(await press('PageUp'), { x: 0.5, y: 0.3 });
    assert.deepEqual(await press('Home'), { x: 0, y: 0.3 });
    assert.deepEqual(await press('Shift+ArrowRight'), { x: 0.01, y: 0.3 });
    assert.deepEqual(await press('End'), { x: 1, y: 0.3 });
    assert.deepEqual(await press('PageDown'), { x: 1, y: 0.5 });
    assert.equal(
      await slider.getAttribute('aria-valuetext'),
      'Light from right, far, 100 % · 50 %',
    );
    assert.equal(await slider.getAttribute('aria-valuenow'), '100');
    await press('Escape');
    assert.equal(await slider.evaluate((element) => element.matches(':focus')), false);
  });

  test('goes through the lights, zooms and pans', async (t) => {
    const { page } = await visit(t, { zoom: '' });
    await page.keyboard.press('Tab');
    await page.keyboard.press(']');
    const light = () => page.evaluate('photo.activeLight');
    assert.equal(await light(), 'checkerboard');
    await page.getByRole('status').getByText('Light: Checkerboard').waitFor({ state: 'attached' });
    assert.equal(await page.getByRole('slider').count(), 0, 'nothing says that it can be moved');
    // The focus would go with the slider; the picture takes its place.
    assert.ok(
      await page.getByRole('group', { name: 'Picture' }).evaluate((e) => e.matches(':focus')),
    );
    await page.keyboard.press('[');
    await page.keyboard.press('[');
    assert.equal(await light(), 'flood');
    assert.equal(await page.evaluate('photo.light'), 'torch', 'the attribute is the page’s');
    await page.keyboard.press(']');
    assert.ok(await page.getByRole('slider').evaluate((e) => e.matches(':focus')));
    await page.keyboard.press('[');
    await page.keyboard.press('+');
    await page.keyboard.press('+');
    assert.equal((await viewOf(page)).zoom, 2.25);
    await page.getByRole('status').getByText('Zoom 2.3×').waitFor({ state: 'attached' });
    await page.keyboard.press('ArrowRight');
    const { x } = await viewOf(page);
    assert.ok(x > 0.55, String(x));
    await page.keyboard.press('a');
    await page.keyboard.press('a');
    assert.ok((await viewOf(page)).x < x);
    await page.keyboard.press('-');
    assert.equal((await viewOf(page)).zoom, 1.5);
    await page.keyboard.press('0');
    assert.equal((await viewOf(page)).zoom, 1);
  });
});

describe('the controls', () => {
  test('are one stop of the tab key, with arrows between them', async (t) => {
    const { page } = await visit(t, { controls: '', zoom: '' });
    await page.keyboard.press('Tab');
    await page.keyboard.press('Tab');
    const focused = () =>
      page.evaluate("photo.shadowRoot.activeElement.getAttribute('aria-label')");
    assert.equal(await focused(), 'Light: Torch');
    await page.keyboard.press('ArrowRight');
    assert.equal(await focused(), 'Zoom out');
    await page.keyboard.press('End');
    assert.equal(await focused(), 'Full screen');
    await page.keyboard.press('ArrowRight');
    assert.equal(await focused(), 'Light: Torch');
    await page.keyboard.press('Enter');
    const radio = page.getByRole('radio', { name: 'Torch' });
    assert.ok(await radio.evaluate((element) => element.matches(':focus')));
    await page.keyboard.press('ArrowDown');
    assert.equal(await page.evaluate('photo.activeLight'), 'checkerboard');
    await page.keyboard.press('Escape');
    assert.equal(await focused(), 'Light: Checkerboard');
    assert.equal(await page.getByRole('radio').count(), 0);
  });

  test('zoom, reset, and hide while a mouse rests', async (t) => {
    const { page, at } = await visit(t, { controls: '', zoom: '2' });
    await page.getByRole('toolbar', { name: 'Controls' }).waitFor();
    await page.getByRole('button', { name: 'Zoom in' }).click();
    assert.equal((await viewOf(page)).zoom, 1.5);
    await page.getByRole('button', { name: 'Zoom in' }).click();
    const more = page.getByRole('button', { name: 'Zoom in' });
    assert.equal(await more.getAttribute('aria-disabled'), 'true');
    const point = at(0.3, 0.3);
    await page.mouse.move(point.x, point.y);
    assert.notEqual(await torchOf(page), null);
    await page.getByRole('button', { name: 'Reset' }).click();
    assert.equal((await viewOf(page)).zoom, 1);
    assert.equal(await torchOf(page), null);
    await page.mouse.click(point.x, point.y);
    await page.waitForFunction(
      "getComputedStyle(photo.shadowRoot.querySelector('[role=toolbar]')).opacity === '0'",
    );
    await page.keyboard.press('ArrowRight');
    await page.waitForFunction(
      "getComputedStyle(photo.shadowRoot.querySelector('[role=toolbar]')).opacity === '1'",
    );
  });

  test('fill the screen, and leave it', async (t) => {
    const { page } = await visit(t, { controls: '' });
    await page.getByRole('button', { name: 'Full screen' }).click();
    await page.waitForFunction('document.fullscreenElement === photo');
    const stage = await page.getByRole('img', { name: 'A window' }).boundingBox();
    const view = page.viewportSize();
    assert.ok(stage && view && Math.abs(stage.height - view.height) < 2, JSON.stringify(stage));
    await page.getByRole('button', { name: 'Leave full screen' }).click();
    await page.waitForFunction('document.fullscreenElement === null');
  });

  test('may be the page’s own', async (t) => {
    const { page } = await visit(t, { controls: '' });
    await page.evaluate(`photo.innerHTML = '<button slot="controls">Mine</button>'`);
    await page.getByRole('button', { name: 'Mine' }).click();
    assert.equal(await page.getByRole('toolbar').count(), 0);
  });

  test('stop what plays', async (t) => {
    const { page } = await visit(t, { controls: '', 'autoplay-light': '' });
    await page.waitForFunction('photo.torch !== null');
    await page.getByRole('button', { name: 'Pause' }).click();
    assert.equal(await page.evaluate('photo.paused'), true);
    const rest = await torchOf(page);
    await page.waitForTimeout(200);
    assert.deepEqual(await torchOf(page), rest);
    await page.getByRole('button', { name: 'Play' }).waitFor();
  });
});

describe('fire', () => {
  /** @param {Page} page */
  const shot = async (page) => page.locator('relightable-photo canvas').screenshot();

  test('burns until it is told to stop, and is still where less motion is asked for', async (t) => {
    const { page } = await visit(t, { light: 'fire', controls: '' });
    const first = await shot(page);
    await page.waitForTimeout(500);
    assert.notDeepEqual(await shot(page), first);
    await page.evaluate('photo.paused = true');
    await page.waitForTimeout(400);
    const still = await shot(page);
    await page.waitForTimeout(400);
    assert.deepEqual(await shot(page), still);
    assert.equal(
      await page.evaluate("happened.some(({ type }) => type === 'lightchange')"),
      false,
      'it is one light',
    );
    const { page: calm } = await visit(t, { light: 'fire' }, { reducedMotion: 'reduce' });
    const before = await picture(calm);
    await calm.waitForTimeout(400);
    assert.equal(compare(await picture(calm), before).worst, 0);
    await calm.evaluate('photo.paused = false');
    await calm.waitForTimeout(500);
    assert.notEqual(compare(await picture(calm), before).worst, 0);
  });
});

describe('a light that wanders', () => {
  test('does so until somebody takes it, and again once they have gone', async (t) => {
    const { page, at } = await visit(t, { 'autoplay-light': '' });
    await page.waitForFunction('photo.torch !== null');
    const point = at(0.9, 0.9);
    await page.mouse.move(point.x, point.y);
    await page.waitForTimeout(300);
    assert.deepEqual(await torchOf(page), { x: 0.9, y: 0.9 });
    await page.waitForFunction('photo.torch.x < 0.88', null, { timeout: 20_000 });
  });

  test('rests where less motion is asked for, or nobody looks', async (t) => {
    const { page } = await visit(t, { 'autoplay-light': '' }, { reducedMotion: 'reduce' });
    await page.waitForTimeout(300);
    assert.equal(await torchOf(page), null);
    await page.emulateMedia({ reducedMotion: 'no-preference' });
    await page.waitForFunction('photo.torch !== null');
    await page.evaluate("photo.style.marginTop = '5000px'");
    await page.waitForTimeout(300);
    const rest = await torchOf(page);
    await page.waitForTimeout(300);
    assert.deepEqual(await torchOf(page), rest);
  });
});

describe('a kiosk', () => {
  test('is as it was once its visitor has gone', async (t) => {
    const { page, at } = await visit(t, { kiosk: '5', zoom: '', controls: '' });
    const point = at(0.2, 0.2);
    await page.mouse.dblclick(point.x, point.y);
    await page.keyboard.press(']');
    assert.equal(await page.evaluate('photo.activeLight'), 'checkerboard');
    assert.equal((await viewOf(page)).zoom, 2.5);
    await page.waitForFunction("photo.activeLight === 'torch' && photo.view.zoom === 1");
    assert.equal(await torchOf(page), null);
  });
});

describe('a device that is tilted', () => {
  test('takes the light along where it may', async (t) => {
    const { page } = await visit(t, {});
    const turn = (/** @type {number} */ beta, /** @type {number} */ gamma) =>
      page.evaluate(
        `dispatchEvent(new DeviceOrientationEvent('deviceorientation', { beta: ${beta}, gamma: ${gamma} }))`,
      );
    await turn(10, 10);
    assert.equal(await torchOf(page), null, 'nobody has asked for it');
    assert.equal(await page.evaluate('photo.requestTilt()'), true);
    await turn(10, 10);
    for (let i = 0; i < 20; i += 1) await turn(10, 20);
    const torch = await torchOf(page);
    assert.ok(torch && torch.x > 0.65 && torch.y === 0.5, JSON.stringify(torch));
    await page.evaluate('photo.reset()');
    await turn(10, 0);
    assert.equal(await torchOf(page), null);
    await page.evaluate("DeviceOrientationEvent.requestPermission = async () => 'denied'");
    assert.equal(await page.evaluate('photo.requestTilt()'), false);
  });
});
