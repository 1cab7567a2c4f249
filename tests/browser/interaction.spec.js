/** Mouse, touch, keyboard, toolbar, animation, kiosk mode and tilt. The torch has tests of its own. */

import { expect, test } from './fixtures.js';
import {
  boxOf,
  capturePicture,
  drag,
  mountPhoto,
  pointOf,
  waitForEvents,
  waitForFrames,
  waitForLoad,
  waitUntil,
} from './page-helpers.js';

/** @typedef {import('@playwright/test').Page} Page */

const GLASS = { src: '/photos/glass.ltm', alt: 'A window', light: 'torch', backend: 'cpu' };

/**
 * Opens a page with a large element. `at` converts picture coordinates to a point on the page.
 *
 * @param {import('./fixtures.js').OpenPage} openPage
 * @param {Record<string, string>} attributes
 * @param {import('./fixtures.js').PageOptions} [options]
 */
async function visit(openPage, attributes, options) {
  const page = await openPage('/plain', options);
  await mountPhoto(page, { ...GLASS, ...attributes });
  await page.evaluate("photo.style.width = '320px'");
  await waitForLoad(page);
  await waitUntil(page, 'photo.quality === 1');
  return { page, at: await pointOf(page) };
}

/** @param {Page} page */
const viewOf = async (page) =>
  /** @type {import('../../www/src/index.js').ZoomView} */ (await page.evaluate('photo.view'));

/** @param {Page} page */
const torchOf = async (page) =>
  /** @type {import('../../www/src/index.js').PicturePoint | null} */ (
    await page.evaluate('photo.torch')
  );

/**
 * Makes a function that sends touch events with any number of fingers.
 *
 * @param {Page} page
 */
async function touchInput(page) {
  const session = await page.context().newCDPSession(page);
  // Every event is a frame after the last, however slow the machine is: a gesture has a speed.
  let seconds = Date.now() / 1000;
  return (
    /** @type {'touchStart' | 'touchMove' | 'touchEnd'} */ type,
    /** @type {{ x: number, y: number }[]} */ ...points
  ) => {
    seconds += FRAME_SECONDS;
    return session.send('Input.dispatchTouchEvent', {
      type,
      touchPoints: points.map((point, id) => ({ ...point, id })),
      timestamp: seconds,
    });
  };
}

const FRAME_SECONDS = 1 / 60;
/** Longer than the time between the taps of a double tap. */
const DOUBLE_TAP_GAP_MS = 1000;
/** Longer than visitors rest before autoplay starts again. */
const REST_MS = 20_000;
const TOUCH = { hasTouch: true, viewport: { width: 400, height: 600 } };

test.describe('the first input', () => {
  /**
   * Opens a page whose script for input arrives when `arrive` is called.
   *
   * @param {import('./fixtures.js').OpenPage} openPage
   * @param {import('./fixtures.js').PageOptions} [options]
   */
  async function visitEarly(openPage, options) {
    const page = await openPage('/plain', options);
    let arrive = () => {};
    /** @type {Promise<void>} */
    const held = new Promise((resolve) => {
      arrive = resolve;
    });
    await page.route('**/relightable-photo-input.js', async (route) => {
      await held;
      await route.continue();
    });
    await mountPhoto(page, GLASS);
    await page.evaluate("photo.style.width = '320px'");
    await waitForLoad(page);
    return { page, arrive, at: await pointOf(page) };
  }

  test('of a mouse and of keys before their script is not lost', async ({ openPage }) => {
    const { page, arrive, at } = await visitEarly(openPage);
    await page.evaluate(() => {
      /** @type {string[]} */
      const heard = [];
      for (const type of ['pointerdown', 'keydown']) {
        addEventListener(type, (event) => heard.push(event.type));
      }
      Object.assign(globalThis, { heard });
    });
    const { x, y } = at(0.25, 0.75);
    await page.mouse.click(x, y);
    await page.getByRole('slider').focus();
    await page.keyboard.press('ArrowRight');
    expect(await torchOf(page)).toBeNull();
    arrive();
    await waitUntil(page, 'photo.torch !== null');
    expect(await torchOf(page)).toStrictEqual({ x: 0.3, y: 0.75 });
    const heard = await page.evaluate('heard');
    expect(heard.filter((/** @type {string} */ type) => type === 'pointerdown').length).toBe(1);
  });

  test('of a finger that is still down goes on', async ({ openPage }) => {
    const { page, arrive, at } = await visitEarly(openPage, TOUCH);
    const touch = await touchInput(page);
    await touch('touchStart', at(0.25, 0.5));
    arrive();
    await waitUntil(page, 'photo.torch !== null');
    expect((await torchOf(page))?.x).toBeCloseTo(0.25, 2);
    await touch('touchMove', at(0.75, 0.5));
    await waitUntil(page, 'photo.torch.x > 0.7');
    await touch('touchEnd');
  });
});

test.describe('zooming', () => {
  test('with the wheel keeps the point under the pointer, and the light', async ({ openPage }) => {
    const { page, at } = await visit(openPage, { zoom: '' });
    const point = at(0.25, 0.75);
    await page.mouse.move(point.x, point.y);
    for (let i = 0; i < 4; i += 1) await page.mouse.wheel(0, -120);
    await waitUntil(page, 'Math.abs(photo.view.zoom - 4) < 0.01');
    const { zoom, x, y } = await viewOf(page);
    expect(Math.abs(x + (0.25 - 0.5) / zoom - 0.25)).toBeLessThan(2e-3);
    expect(Math.abs(y + (0.75 - 0.5) / zoom - 0.75)).toBeLessThan(2e-3);
    expect(await torchOf(page)).toStrictEqual({ x: 0.25, y: 0.75 });
    const last = (await waitForEvents(page, 'viewchange')).findLast((e) => e.type === 'viewchange');
    expect(last).toStrictEqual({ type: 'viewchange', zoom, x, y });
    const canvas = page.locator('relightable-photo canvas');
    const { width } = await boxOf(canvas);
    expect(Math.abs(width - zoom * 320), String(width)).toBeLessThan(1);
    // The torch follows the pointer in the zoomed view as well.
    const corner = at(1, 0);
    await page.mouse.move(corner.x - 1, corner.y + 1);
    const torch = await torchOf(page);
    expect(torch?.x).toBeCloseTo(x + 0.5 / zoom, 2);
    expect(torch?.y).toBeCloseTo(y - 0.5 / zoom, 2);
  });

  test('scrolls the page at the smallest zoom, and without the zoom attribute', async ({
    openPage,
  }) => {
    const { page, at } = await visit(openPage, { zoom: '2' });
    await page.evaluate(
      "document.body.insertAdjacentHTML('beforeend', '<p style=\"height: 3000px\">')",
    );
    const point = at(0.5, 0.5);
    await page.mouse.move(point.x, point.y);
    for (let i = 0; i < 2; i += 1) await page.mouse.wheel(0, -120);
    await waitUntil(page, 'photo.view.zoom === 2');
    expect(await page.evaluate('scrollY')).toBe(0);
    for (let i = 0; i < 4; i += 1) await page.mouse.wheel(0, 120);
    await waitUntil(page, 'photo.view.zoom === 1 && scrollY > 0');
    await page.evaluate("scrollTo(0, 0), photo.removeAttribute('zoom')");
    await page.mouse.wheel(0, 120);
    await waitUntil(page, 'scrollY > 0');
  });

  test('needs Ctrl under cooperative-gestures, which a hint says', async ({ openPage }) => {
    const { page, at } = await visit(openPage, { zoom: '', 'cooperative-gestures': '' });
    await page.evaluate(
      "document.body.insertAdjacentHTML('beforeend', '<p style=\"height: 3000px\">')",
    );
    const point = at(0.5, 0.5);
    await page.mouse.move(point.x, point.y);
    await page.mouse.wheel(0, 60);
    await waitUntil(page, 'scrollY > 0');
    await page.getByText('Ctrl + scroll to zoom').waitFor({ state: 'visible' });
    await page.getByText('Ctrl + scroll to zoom').waitFor({ state: 'hidden' });
    await page.evaluate('scrollTo(0, 0)');
    await page.keyboard.down('Control');
    await page.mouse.wheel(0, -120);
    await page.keyboard.up('Control');
    await waitUntil(page, 'photo.view.zoom > 1.2');
    expect(await page.evaluate('scrollY')).toBe(0);
  });

  test('with two fingers keeps the light', async ({ openPage }) => {
    const { page, at } = await visit(openPage, { zoom: '', 'light-x': '0.9' }, TOUCH);
    const touch = await touchInput(page);
    await touch('touchStart', at(0.4, 0.5));
    expect((await torchOf(page))?.x).toBe(0.4);
    await touch('touchStart', at(0.4, 0.5), at(0.6, 0.5));
    await touch('touchMove', at(0.3, 0.5), at(0.7, 0.5));
    await touch('touchMove', at(0.2, 0.6), at(0.8, 0.6));
    await touch('touchEnd');
    const { zoom, y } = await viewOf(page);
    expect(Math.abs(zoom - 3), String(zoom)).toBeLessThan(0.1);
    expect(y, 'the picture went down with the fingers').toBeLessThan(0.5);
    expect(await torchOf(page)).toStrictEqual({ x: 0.9, y: 0.5 });
  });

  test('changes with a double tap or a double click', async ({ openPage }) => {
    const { page, at } = await visit(openPage, { zoom: '' }, { ...TOUCH, fakeClock: true });
    const point = at(0.25, 0.25);
    const doubleTap = async () => {
      await page.touchscreen.tap(point.x, point.y);
      await page.touchscreen.tap(point.x, point.y);
    };
    await doubleTap();
    expect((await viewOf(page)).zoom).toBe(2.5);
    await page.clock.fastForward(DOUBLE_TAP_GAP_MS);
    await doubleTap();
    expect(await viewOf(page)).toStrictEqual({ zoom: 1, x: 0.5, y: 0.5 });
    await page.clock.fastForward(DOUBLE_TAP_GAP_MS);
    await page.mouse.dblclick(point.x, point.y);
    expect((await viewOf(page)).zoom).toBe(2.5);
  });

  test('by a script stays within its limits', async ({ openPage }) => {
    const { page } = await visit(openPage, { zoom: '4' });
    await page.evaluate('photo.view = { zoom: 100, x: 0, y: 0.5 }');
    expect(await viewOf(page)).toStrictEqual({ zoom: 4, x: 0.125, y: 0.5 });
    await page.evaluate("photo.removeAttribute('zoom')");
    await waitForEvents(page, 'viewchange', 2);
    expect(await viewOf(page)).toStrictEqual({ zoom: 1, x: 0.5, y: 0.5 });
    await expect(page.evaluate('photo.view = { zoom: "2" }')).rejects.toThrow(/finite number/);
  });

  test('pans with Shift, with the middle button and with Space, but only when zoomed in', async ({
    openPage,
  }) => {
    // The picture does not glide on.
    const { page, at } = await visit(openPage, { zoom: '' }, { reducedMotion: 'reduce' });
    const xAfterDrag = async (/** @type {'left' | 'middle'} */ button = 'left') => {
      await drag(page, at(0.5, 0.5), at(0.6, 0.5), button);
      return (await viewOf(page)).x;
    };
    const begin = 'photo.view = { zoom: 2, x: 0.5, y: 0.5 }';
    await page.evaluate(begin);
    await page.keyboard.down('Shift');
    expect(Math.abs((await xAfterDrag()) - 0.45)).toBeLessThan(1e-3);
    await page.keyboard.up('Shift');
    await page.evaluate(begin);
    expect(Math.abs((await xAfterDrag('middle')) - 0.45)).toBeLessThan(1e-3);
    await page.evaluate(begin);
    // The first drag focused the picture.
    await page.keyboard.down(' ');
    expect(Math.abs((await xAfterDrag()) - 0.45)).toBeLessThan(1e-3);
    await page.keyboard.up(' ');
    await page.evaluate(begin);
    expect(await xAfterDrag(), 'a plain drag moves the torch').toBe(0.5);
    expect((await torchOf(page))?.x).not.toBe(0.5);
    await page.evaluate("photo.light = 'flood'");
    expect(Math.abs((await xAfterDrag()) - 0.45), 'under flood a plain drag pans').toBeLessThan(
      1e-3,
    );
    await page.evaluate('photo.view = { zoom: 1, x: 0.5, y: 0.5 }');
    expect(await xAfterDrag()).toBe(0.5);
  });
});

test.describe('a magnified picture', () => {
  test('that is released in motion glides on until it is pressed', async ({ openPage }) => {
    const { page, at } = await visit(openPage, { zoom: '', light: 'flood' });
    await page.evaluate('photo.view = { zoom: 8, x: 0.5, y: 0.5 }');
    await drag(page, at(0.2, 0.5), at(0.3, 0.5));
    // The drag itself moves it by a tenth of an eighth.
    await waitUntil(page, 'photo.view.x < 0.48');
    await page.mouse.down();
    const { x } = await viewOf(page);
    await waitForFrames(page, 3);
    expect((await viewOf(page)).x).toBe(x);
    await page.mouse.up();
    await page.evaluate('photo.view = { zoom: 8, x: 0.5, y: 0.5 }');
    await drag(page, at(0.2, 0.5), at(0.3, 0.5));
    await page.evaluate('photo.viewTo({ zoom: 8, x: 0.6 }, { duration: 0 })');
    await waitForFrames(page, 3);
    expect((await viewOf(page)).x, 'a script stops it as well').toBe(0.6);
  });

  test('has a pixel of the screen for each of its own by key and by script', async ({
    openPage,
  }) => {
    const { page, at } = await visit(openPage, { zoom: '' });
    await page.evaluate("photo.style.width = '24px'");
    const point = at(0.01, 0.01);
    await page.mouse.click(point.x, point.y);
    await page.keyboard.press('1');
    const zoom = Number(await page.evaluate('photo.info.width / 24 / devicePixelRatio'));
    expect((await viewOf(page)).zoom).toBeCloseTo(zoom, 2);
    await page.evaluate('photo.view = { scale: 0.75, x: 0.4 }');
    expect((await viewOf(page)).zoom).toBeCloseTo(0.75 * zoom, 2);
    await page.evaluate('photo.viewTo({ scale: 1 }, { duration: 0 })');
    await waitUntil(page, `Math.abs(photo.view.zoom - ${zoom}) < 0.01`);
    expect((await viewOf(page)).x).toBe(0.4);
  });
});

test.describe('a finger', () => {
  test('scrolls the page vertically', async ({ openPage }) => {
    const { page, at } = await visit(openPage, {}, TOUCH);
    await page.evaluate(
      "document.body.insertAdjacentHTML('beforeend', '<p style=\"height: 3000px\">')",
    );
    const touch = await touchInput(page);
    await touch('touchStart', at(0.5, 0.9));
    for (let i = 1; i <= 8; i += 1) await touch('touchMove', at(0.5, 0.9 - 0.1 * i));
    await touch('touchEnd');
    await waitUntil(page, 'scrollY > 50');
  });

  test('that lifts while moving throws the light, unless the visitor prefers reduced motion', async ({
    openPage,
  }) => {
    for (const reducedMotion of /** @type {const} */ (['no-preference', 'reduce'])) {
      const { page, at } = await visit(openPage, { zoom: '' }, { ...TOUCH, reducedMotion });
      const touch = await touchInput(page);
      await touch('touchStart', at(0.1, 0.5));
      for (let i = 1; i <= 4; i += 1) await touch('touchMove', at(0.1 + 0.05 * i, 0.5));
      await touch('touchEnd');
      if (reducedMotion === 'reduce') {
        await waitForFrames(page);
        expect((await torchOf(page))?.x).toBe(0.3);
      } else {
        await waitUntil(page, 'photo.torch.x > 0.32');
      }
    }
  });
});

test.describe('the keyboard', () => {
  test('moves the light by small and large steps and to the edges, and Escape removes the focus', async ({
    openPage,
  }) => {
    const { page } = await visit(openPage, {});
    await page.keyboard.press('ArrowLeft');
    expect(await torchOf(page), 'without the focus, keys belong to the page').toBeNull();
    await page.keyboard.press('Tab');
    const slider = page.getByRole('slider', { name: 'Light' });
    const press = async (/** @type {string} */ key) => {
      await page.keyboard.press(key);
      return torchOf(page);
    };
    expect(await press('PageUp')).toStrictEqual({ x: 0.5, y: 0.3 });
    expect(await press('Home')).toStrictEqual({ x: 0, y: 0.3 });
    expect(await press('Shift+ArrowRight')).toStrictEqual({ x: 0.01, y: 0.3 });
    expect(await press('End')).toStrictEqual({ x: 1, y: 0.3 });
    expect(await press('PageDown')).toStrictEqual({ x: 1, y: 0.5 });
    expect(await slider.getAttribute('aria-valuetext')).toBe('Light from right, far, 100% · 50%');
    expect(await slider.getAttribute('aria-valuenow')).toBe('100');
    await press('Escape');
    expect(await slider.evaluate((element) => element.matches(':focus'))).toBe(false);
  });

  test('changes the light, zooms and pans', async ({ openPage }) => {
    const { page } = await visit(openPage, { zoom: '' });
    await page.keyboard.press('Tab');
    await page.keyboard.press(']');
    const light = () => page.evaluate('photo.activeLight');
    expect(await light()).toBe('checkerboard');
    await page.getByRole('status').getByText('Light: Checkerboard').waitFor({ state: 'attached' });
    expect(await page.getByRole('slider').count(), 'a light without a position has no slider').toBe(
      0,
    );
    // The slider is gone, so the picture takes the focus.
    expect(
      await page.getByRole('group', { name: 'Picture' }).evaluate((e) => e.matches(':focus')),
    ).toBeTruthy();
    await page.keyboard.press('[');
    await page.keyboard.press('[');
    expect(await light()).toBe('flood');
    expect(
      await page.evaluate("photo.getAttribute('light')"),
      'the attribute keeps the page’s value',
    ).toBe('torch');
    await page.keyboard.press(']');
    expect(await page.getByRole('slider').evaluate((e) => e.matches(':focus'))).toBeTruthy();
    await page.keyboard.press('[');
    await page.keyboard.press('+');
    await page.keyboard.press('+');
    expect((await viewOf(page)).zoom).toBe(2.25);
    await page.getByRole('status').getByText('Zoom 2.3×').waitFor({ state: 'attached' });
    await page.keyboard.press('ArrowRight');
    const { x } = await viewOf(page);
    expect(x, String(x)).toBeGreaterThan(0.55);
    await page.keyboard.press('a');
    await page.keyboard.press('a');
    expect((await viewOf(page)).x).toBeLessThan(x);
    await page.keyboard.press('-');
    expect((await viewOf(page)).zoom).toBe(1.5);
    await page.keyboard.press('0');
    expect((await viewOf(page)).zoom).toBe(1);
  });
});

test.describe('the controls', () => {
  test('are one tab stop, and arrow keys move between them', async ({ openPage }) => {
    const { page } = await visit(openPage, { controls: '', zoom: '' });
    await page.keyboard.press('Tab');
    await page.keyboard.press('Tab');
    const focused = () =>
      page.evaluate("photo.shadowRoot.activeElement.getAttribute('aria-label')");
    expect(await focused()).toBe('Light: Torch');
    await page.keyboard.press('ArrowRight');
    expect(await focused()).toBe('Zoom out');
    await page.keyboard.press('End');
    expect(await focused()).toBe('Full screen');
    await page.keyboard.press('ArrowRight');
    expect(await focused()).toBe('Light: Torch');
    await page.keyboard.press('Enter');
    const radio = page.getByRole('radio', { name: 'Torch' });
    expect(await radio.evaluate((element) => element.matches(':focus'))).toBeTruthy();
    await page.keyboard.press('ArrowDown');
    expect(await page.evaluate('photo.activeLight')).toBe('checkerboard');
    await page.keyboard.press('Escape');
    expect(await focused()).toBe('Light: Checkerboard');
    expect(await page.getByRole('radio').count()).toBe(0);
  });

  test('zoom, reset, and hide while the pointer rests', async ({ openPage }) => {
    const { page, at } = await visit(openPage, { controls: '', zoom: '2' });
    await page.getByRole('toolbar', { name: 'Controls' }).waitFor();
    await page.getByRole('button', { name: 'Zoom in' }).click();
    expect((await viewOf(page)).zoom).toBe(1.5);
    await page.getByRole('button', { name: 'Zoom in' }).click();
    const more = page.getByRole('button', { name: 'Zoom in' });
    expect(await more.getAttribute('aria-disabled')).toBe('true');
    const point = at(0.3, 0.3);
    await page.mouse.move(point.x, point.y);
    expect(await torchOf(page)).not.toBeNull();
    await page.getByRole('button', { name: 'Reset' }).click();
    expect((await viewOf(page)).zoom).toBe(1);
    expect(await torchOf(page)).toBeNull();
    await page.mouse.click(point.x, point.y);
    await waitUntil(
      page,
      "getComputedStyle(photo.shadowRoot.querySelector('[role=toolbar]')).opacity === '0'",
    );
    await page.keyboard.press('ArrowRight');
    await waitUntil(
      page,
      "getComputedStyle(photo.shadowRoot.querySelector('[role=toolbar]')).opacity === '1'",
    );
  });

  test('come back as the pointer moves, under any light', async ({ openPage }) => {
    const { page, at } = await visit(openPage, { controls: '' });
    const opacity = "getComputedStyle(photo.shadowRoot.querySelector('[role=toolbar]')).opacity";
    const point = at(0.3, 0.3);
    await page.mouse.move(point.x, point.y);
    await page.evaluate("photo.light = 'flood'");
    await waitUntil(page, `${opacity} === '0'`);
    await page.mouse.move(point.x + 10, point.y + 10);
    await waitUntil(page, `${opacity} === '1'`);
  });

  test('enter and leave full screen', async ({ openPage }) => {
    const { page } = await visit(openPage, { controls: '' });
    await page.getByRole('button', { name: 'Full screen' }).click();
    await waitUntil(page, 'document.fullscreenElement === photo');
    const { height } = await boxOf(page.getByRole('img', { name: 'A window' }));
    expect(Math.abs(height - (page.viewportSize()?.height ?? 0))).toBeLessThan(2);
    await page.getByRole('button', { name: 'Leave full screen' }).click();
    await waitUntil(page, 'document.fullscreenElement === null');
  });

  test('can be replaced by the page’s own', async ({ openPage }) => {
    const { page } = await visit(openPage, { controls: '' });
    await page.evaluate(`photo.innerHTML = '<button slot="controls">Mine</button>'`);
    await page.getByRole('button', { name: 'Mine' }).click();
    expect(await page.getByRole('toolbar').count()).toBe(0);
  });

  test('pause the animation', async ({ openPage }) => {
    const { page } = await visit(openPage, { controls: '', 'autoplay-light': '' });
    await waitUntil(page, 'photo.torch !== null');
    await page.getByRole('button', { name: 'Pause' }).click();
    expect(await page.evaluate('photo.paused')).toBe(true);
    const rest = await torchOf(page);
    await waitForFrames(page);
    expect(await torchOf(page)).toStrictEqual(rest);
    await page.getByRole('button', { name: 'Play' }).waitFor();
  });
});

test.describe('fire', () => {
  /** @param {Page} page */
  const screenshot = (page) => page.locator('relightable-photo canvas').screenshot();

  test('burns until it is paused, and rests under reduced motion', async ({ openPage }) => {
    const { page } = await visit(openPage, { light: 'fire', controls: '' });
    const first = await screenshot(page);
    await expect.poll(async () => first.equals(await screenshot(page))).toBe(false);
    await page.evaluate('photo.pause()');
    await capturePicture(page);
    await waitForFrames(page, 5);
    const paused = await screenshot(page);
    await waitForFrames(page);
    expect(paused.equals(await screenshot(page))).toBe(true);
    expect(
      await page.evaluate("photoEvents.some(({ type }) => type === 'lightchange')"),
      'fire remains one light',
    ).toBe(false);
    const { page: calm } = await visit(openPage, { light: 'fire' }, { reducedMotion: 'reduce' });
    const before = await capturePicture(calm);
    await waitForFrames(calm);
    expect(await capturePicture(calm)).toMatchPicture(before, 0);
    await calm.evaluate('photo.play()');
    await expect(async () => {
      expect(await capturePicture(calm)).not.toMatchPicture(before, 0);
    }).toPass();
  });
});

test.describe('autoplay', () => {
  test('stops while a visitor moves the light, and starts again afterwards', async ({
    openPage,
  }) => {
    const { page, at } = await visit(openPage, { 'autoplay-light': '' }, { fakeClock: true });
    await waitUntil(page, 'photo.torch !== null');
    const point = at(0.9, 0.9);
    await page.mouse.move(point.x, point.y);
    await expect.poll(() => torchOf(page)).toStrictEqual({ x: 0.9, y: 0.9 });
    await page.clock.fastForward(REST_MS);
    await waitUntil(page, 'photo.torch.x < 0.88');
  });

  test('rests under reduced motion and outside the viewport', async ({ openPage }) => {
    const { page } = await visit(openPage, { 'autoplay-light': '' }, { reducedMotion: 'reduce' });
    await waitForFrames(page);
    expect(await torchOf(page)).toBeNull();
    await page.emulateMedia({ reducedMotion: 'no-preference' });
    await waitUntil(page, 'photo.torch !== null');
    await page.evaluate("photo.style.marginTop = '5000px'");
    // The browser reports the visibility within a few frames.
    await waitForFrames(page, 5);
    const rest = await torchOf(page);
    await waitForFrames(page);
    expect(await torchOf(page)).toStrictEqual(rest);
  });
});

test.describe('kiosk mode', () => {
  test('resets light and view after a rest', async ({ openPage }) => {
    const attributes = { kiosk: '5', zoom: '', controls: '' };
    const { page, at } = await visit(openPage, attributes, { fakeClock: true });
    const point = at(0.2, 0.2);
    await page.mouse.dblclick(point.x, point.y);
    await page.keyboard.press(']');
    expect(await page.evaluate('photo.activeLight')).toBe('checkerboard');
    expect((await viewOf(page)).zoom).toBe(2.5);
    await page.clock.fastForward(6_000);
    await waitUntil(page, "photo.activeLight === 'torch' && photo.view.zoom === 1");
    expect(await torchOf(page)).toBeNull();
  });

  test('rests only while the toolbar does', async ({ openPage }) => {
    const attributes = { kiosk: '5', zoom: '', controls: '' };
    const { page } = await visit(openPage, attributes, { fakeClock: true });
    const zoomIn = page.getByRole('button', { name: 'Zoom in' });
    await zoomIn.click();
    await page.clock.fastForward(4_000);
    await zoomIn.click();
    await page.clock.fastForward(4_000);
    await waitForFrames(page);
    expect((await viewOf(page)).zoom, 'eight seconds after the first press').toBeGreaterThan(1);
    await page.clock.fastForward(2_000);
    await waitUntil(page, 'photo.view.zoom === 1');
  });
});

test.describe('tilting the device', () => {
  test('moves the light once permission is granted', async ({ openPage }) => {
    const permissions = ['accelerometer', 'gyroscope'];
    const { page } = await visit(openPage, {}, { permissions });
    const tilt = (/** @type {number} */ beta, /** @type {number} */ gamma) =>
      page.evaluate(
        `dispatchEvent(new DeviceOrientationEvent('deviceorientation', { beta: ${beta}, gamma: ${gamma} }))`,
      );
    await tilt(10, 10);
    expect(await torchOf(page), 'nothing has requested tilt').toBeNull();
    expect(await page.evaluate('photo.requestTilt()')).toBe(true);
    await tilt(10, 10);
    for (let i = 0; i < 20; i += 1) await tilt(10, 20);
    const torch = await torchOf(page);
    expect(torch?.x).toBeGreaterThan(0.65);
    expect(torch?.y).toBe(0.5);
    await page.evaluate('photo.reset()');
    await tilt(10, 0);
    expect(await torchOf(page)).toBeNull();
    await page.evaluate("DeviceOrientationEvent.requestPermission = async () => 'denied'");
    expect(await page.evaluate('photo.requestTilt()')).toBe(false);
  });
});
