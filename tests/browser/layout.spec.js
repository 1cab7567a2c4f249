/**
 * The element's place on the page: its natural size, `object-fit`, layout shifts, full screen; what lies over the
 * picture; and print.
 */

import { expect, test } from './fixtures.js';
import {
  checkLayoutBoxes,
  containedIn,
  expectRect,
  layoutOf,
  mountInBox,
  RATIO,
  waitForPicture,
} from './layout-boxes.js';
import { boxOf, mountPhoto, waitForFrames, waitForLoad, waitUntil } from './page-helpers.js';

/** @typedef {import('@playwright/test').Page} Page */
/** @typedef {import('./layout-boxes.js').Rect} Rect */

const GLASS = { src: '/photos/glass.ltm', alt: 'A window', light: 'torch', backend: 'cpu' };
const BOX = { css: 'width: 300px; height: 200px' };

test('an element contains its picture in boxes of every kind', async ({ openPage, step }) => {
  const page = await openPage('/plain');
  await checkLayoutBoxes(page, step);
});

/** The picture in a box of 300 × 200 pixels at the page's origin. @type {Record<string, Rect>} */
const FITS = {
  contain: { left: 125, top: 0, width: 50, height: 200 },
  cover: { left: 0, top: -500, width: 300, height: 1200 },
  fill: { left: 0, top: 0, width: 300, height: 200 },
  none: { left: 86, top: -156, width: 128, height: 512 },
  'scale-down': { left: 125, top: 0, width: 50, height: 200 },
};

/** @type {Record<string, [left: number, top: number]>} */
const POSITIONS = {
  '0 0': [0, 0],
  'right bottom': [250, 0],
  '10px 20px': [10, 20],
  'right 10px top 25%': [240, 0],
  'calc(50% + 5px) 50%': [130, 0],
};

test('object-fit and object-position place the picture', async ({ openPage, step }) => {
  const page = await openPage('/plain');
  await mountInBox(page, BOX);
  await waitForPicture(page);
  for (const [fit, expected] of Object.entries(FITS)) {
    await step(`object-fit: ${fit}`, async () => {
      await page.evaluate(`void (photo.style.objectFit = '${fit}')`);
      const { element, picture } = await layoutOf(page);
      expectRect(element, { left: 0, top: 0, width: 300, height: 200 }, 'the element');
      expectRect(picture, expected, fit);
    });
  }
  await page.evaluate("void (photo.style.objectFit = 'contain')");
  for (const [position, [left, top]] of Object.entries(POSITIONS)) {
    await step(`object-position: ${position}`, async () => {
      await page.evaluate(`void (photo.style.objectPosition = '${position}')`);
      const { picture } = await layoutOf(page);
      expectRect(picture, { left, top, width: 50, height: 200 }, position);
    });
  }
  await step('a small picture is not scaled up by scale-down', async () => {
    await page.evaluate(
      "void (photo.style.cssText = 'width: 900px; height: 900px; object-fit: scale-down')",
    );
    expectRect(
      (await layoutOf(page)).picture,
      { left: 386, top: 194, width: 128, height: 512 },
      '',
    );
  });
  await step('a class and a media query change object-fit', async () => {
    await page.addStyleTag({
      content:
        '.cut { object-fit: cover } @media (max-width: 500px) { .cut { width: 200px; object-fit: fill } }',
    });
    await page.evaluate("void (photo.style.cssText = 'height: 200px')");
    await page.evaluate("void photo.classList.add('cut')");
    const { element, picture } = await layoutOf(page);
    expectRect(picture, { ...picture, width: element.width }, 'cover');
    expect(picture.height).toBeGreaterThan(1000);
    await page.setViewportSize({ width: 400, height: 400 });
    await waitForFrames(page, 2);
    expectRect(
      (await layoutOf(page)).picture,
      { left: 0, top: 0, width: 200, height: 200 },
      'fill',
    );
  });
});

/** Records layout shifts. For `before` of `openPage`. */
const recordShifts = () => {
  /** @type {number[]} */
  const shifts = [];
  Object.assign(globalThis, { shifts });
  new PerformanceObserver((list) => {
    for (const entry of list.getEntries()) shifts.push(/** @type {any} */ (entry).value);
  }).observe({ type: 'layout-shift', buffered: true });
};

/** The sum of all layout shifts so far. @param {Page} page @returns {Promise<number>} */
const shiftOf = async (page) => {
  // The browser reports a shift after the frame.
  await waitForFrames(page, 5);
  return page.evaluate('shifts.reduce((sum, shift) => sum + shift, 0)');
};

test('an element with width and height shifts nothing', async ({ openPage, step }) => {
  const page = await openPage('/blank', { before: recordShifts });
  /** @type {[what: string, attributes: Record<string, string>, css: string, shifts: boolean][]} */
  const cases = [
    // The test itself can fail: the photograph is four times as high as wide.
    ['neither', {}, '', true],
    ['width and height', { width: '200', height: '800' }, '', false],
    ['width and height in a wide column', { width: '200', height: '800' }, 'width: 100%', false],
    ['width and height of another ratio', { width: '200', height: '100' }, '', false],
    ['width, height and a poster', { width: '100', height: '400', poster: '/half.png' }, '', false],
    ['a ratio in CSS', {}, 'aspect-ratio: 1 / 4', false],
    [
      'width, height and an error',
      { width: '100', height: '400', src: '/photos/absent.ltm' },
      '',
      false,
    ],
  ];
  for (const [what, attributes, css, isShifted] of cases) {
    await step(`an element with ${what}`, async () => {
      await page.goto('/plain');
      await page.evaluate("void document.body.append('Text above')");
      await mountInBox(page, { attributes, css });
      await page.evaluate(() => {
        const below = Object.assign(document.createElement('p'), { textContent: 'Text below' });
        document.querySelector('.box')?.after(below);
      });
      await waitForFrames(page, 2);
      await page.evaluate('photo.ready.catch(() => {}).then(() => {})');
      const shift = await shiftOf(page);
      if (isShifted) expect(shift).toBeGreaterThan(0);
      else expect(shift).toBe(0);
    });
  }
});

test('full screen contains the picture', async ({ openPage }) => {
  const page = await openPage('/plain');
  await mountInBox(page, { css: 'width: 100px' });
  await waitForPicture(page);
  await page.evaluate(() =>
    document.addEventListener('click', () =>
      /** @type {any} */ (globalThis).photo.requestFullscreen(),
    ),
  );
  await page.mouse.click(300, 300);
  await waitUntil(page, 'document.fullscreenElement === photo && photo.clientWidth === innerWidth');
  const { element, picture } = await layoutOf(page);
  expectRect(picture, containedIn(element), 'the picture');
  await page.evaluate("void (photo.style.objectFit = 'cover')");
  const cut = await layoutOf(page);
  expectRect(cut.picture, { ...cut.picture, left: 0, width: cut.element.width }, 'cover');
});

test.describe('the overlay', () => {
  /** A link in the middle of the picture's left half. @param {Page} page */
  const addLink = (page) =>
    page.evaluate(() => {
      const { photo } = /** @type {any} */ (globalThis);
      const link = Object.assign(document.createElement('a'), { slot: 'overlay', href: '#note' });
      link.textContent = 'A note';
      Object.assign(link.style, { left: '25%', top: '50%', width: '40px', height: '20px' });
      photo.append(link);
    });
  /** Where the page says that the link is, from 0 to 1 in the picture. @param {Page} page */
  const linkPoint = (page) =>
    page.evaluate(() => {
      const { photo } = /** @type {any} */ (globalThis);
      const link = document.querySelector('a')?.getBoundingClientRect();
      const { left, top } = photo.getBoundingClientRect();
      return photo.toPicture((link?.left ?? 0) - left, (link?.top ?? 0) - top);
    });
  /** @param {Page} page @param {string} what */
  const expectLinkInPlace = async (page, what) => {
    const point = await linkPoint(page);
    expect(point?.x, `${what}: ${JSON.stringify(point)}`).toBeCloseTo(0.25, 2);
    expect(point?.y, `${what}: ${JSON.stringify(point)}`).toBeCloseTo(0.5, 2);
  };

  test('follows the picture through boxes, zoom and full screen', async ({ openPage, step }) => {
    const page = await openPage('/plain');
    await mountInBox(page, { css: 'width: 600px; height: 400px', attributes: { zoom: '4' } });
    await addLink(page);
    await waitForPicture(page);
    await step('contained', async () => {
      const { picture } = await layoutOf(page);
      const link = await boxOf(page.getByRole('link'));
      expect(link.x).toBeCloseTo(picture.left + picture.width / 4, 0);
      expect(link.y).toBeCloseTo(picture.top + picture.height / 2, 0);
      await expectLinkInPlace(page, 'contained');
    });
    for (const fit of ['cover', 'fill', 'none', 'contain']) {
      await step(fit, async () => {
        await page.evaluate(`void (photo.style.objectFit = '${fit}')`);
        await expectLinkInPlace(page, fit);
      });
    }
    await step('zoomed', async () => {
      await page.evaluate('void (photo.view = { zoom: 2, x: 0.3, y: 0.45 })');
      await waitForFrames(page, 2);
      await expectLinkInPlace(page, 'zoomed');
    });
    await step('in full screen', async () => {
      await page.evaluate('void (photo.view = { zoom: 1, x: 0.5, y: 0.5 })');
      await page.evaluate(() =>
        document.addEventListener('click', () =>
          /** @type {any} */ (globalThis).photo.requestFullscreen(),
        ),
      );
      await page.mouse.click(700, 500);
      await waitUntil(
        page,
        'document.fullscreenElement === photo && photo.clientWidth === innerWidth',
      );
      expect(await page.getByRole('link').isVisible()).toBe(true);
      await expectLinkInPlace(page, 'in full screen');
    });
  });

  test('gets the presses on its links, and the light follows the pointer over it', async ({
    openPage,
  }) => {
    const page = await openPage('/plain');
    await mountInBox(page, { css: 'width: 100px', attributes: { light: 'torch' } });
    await addLink(page);
    await waitForPicture(page);
    const { x, y } = await boxOf(page.getByRole('link'));
    await page.mouse.move(x + 5, y + 5);
    const torch = await page.evaluate('photo.torch');
    expect(torch?.x).toBeCloseTo(0.3, 1);
    await page.mouse.down();
    await page.mouse.up();
    await waitUntil(page, "location.hash === '#note'");
  });
});

test('toPicture and toElement convert positions', async ({ openPage, step }) => {
  const page = await openPage('/plain');
  await mountInBox(page, { ...BOX, attributes: { zoom: '4' } });
  expect(
    await page.evaluate('[photo.toPicture(150, 100), photo.toElement(0.5, 0.5)]'),
  ).toStrictEqual([null, null]);
  await waitForPicture(page);
  /** @param {string} expression */
  const expectPoint = async (expression, /** @type {[number, number]} */ [x, y]) => {
    const point = await page.evaluate(expression);
    expect(point?.x, `${expression}: ${JSON.stringify(point)}`).toBeCloseTo(x, 3);
    expect(point?.y, `${expression}: ${JSON.stringify(point)}`).toBeCloseTo(y, 3);
  };
  await step('in the whole picture', async () => {
    await expectPoint('photo.toPicture(125, 0)', [0, 0]);
    await expectPoint('photo.toPicture(150, 100)', [0.5, 0.5]);
    await expectPoint('photo.toElement(1, 1)', [175, 200]);
    expect(
      await page.evaluate('[photo.toPicture(100, 100), photo.toPicture(150, 201)]'),
    ).toStrictEqual([null, null]);
  });
  await step('in a part of it', async () => {
    await page.evaluate('void (photo.view = { zoom: 2, x: 0.25, y: 0.25 })');
    await expectPoint('photo.toPicture(125, 0)', [0, 0]);
    await expectPoint('photo.toPicture(175, 200)', [0.5, 0.5]);
    await expectPoint('photo.toElement(0.5, 0.25)', [175, 100]);
    await expectPoint('photo.toElement(1, 1)', [225, 400]);
  });
  await step('in a picture that is cut off', async () => {
    await page.evaluate(
      "void (photo.style.objectFit = 'cover', photo.view = { zoom: 1, x: 0.5, y: 0.5 })",
    );
    await expectPoint('photo.toPicture(0, 100)', [0, 0.5]);
    await expectPoint('photo.toElement(1, 0)', [300, -500]);
  });
});

test('the pointer moves the light in a picture that is contained', async ({ openPage }) => {
  const page = await openPage('/plain');
  await mountInBox(page, { ...BOX, attributes: { light: 'torch' } });
  await waitForPicture(page);
  await page.mouse.move(20, 20);
  await waitForFrames(page, 2);
  expect(await page.evaluate('photo.torch'), 'beside the picture').toBeNull();
  await page.mouse.move(125 + 0.2 * 200 * RATIO, 160);
  const torch = await page.evaluate('photo.torch');
  expect(torch?.x).toBeCloseTo(0.2, 1);
  expect(torch?.y).toBeCloseTo(0.8, 1);
});

test.describe('in print', () => {
  test('an element shows its picture alone', async ({ openPage, step }) => {
    const page = await openPage('/plain');
    await mountPhoto(page, { ...GLASS, controls: '', zoom: '4' });
    await page.evaluate("void (photo.style.width = '300px')");
    await waitForLoad(page);
    const toolbar = page.getByRole('toolbar');
    await toolbar.waitFor();
    await page.keyboard.press('Tab');
    await expect(page.getByRole('slider')).toBeFocused();
    const picture = page.locator('relightable-photo [part=picture]');
    await page.evaluate('void photo.toBlob().then(() => {}, () => {})');
    await page.emulateMedia({ media: 'print' });
    await step('without controls and focus', async () => {
      await expect(toolbar).toBeHidden();
      await expect(page.getByRole('slider')).toBeHidden();
      expect(await picture.isVisible()).toBe(true);
    });
    await step('without progress and messages', async () => {
      await page.emulateMedia({ media: 'screen' });
      await page.evaluate("void (photo.src = '/photos/absent.ltm')");
      await page.getByRole('alert').waitFor();
      await page.emulateMedia({ media: 'print' });
      await expect(page.getByRole('alert')).toBeHidden();
      await page.emulateMedia({ media: 'screen' });
      await page.evaluate("void (photo.src = '/faults/slow')");
      await page.getByRole('progressbar').waitFor();
      await page.emulateMedia({ media: 'print' });
      await expect(page.getByRole('progressbar')).toBeHidden();
    });
  });

  test('an element below the viewport shows its poster, and is loaded', async ({ openPage }) => {
    const page = await openPage('/plain');
    await page.evaluate("void (document.body.style.paddingTop = '9000px')");
    await mountPhoto(page, { ...GLASS, loading: 'lazy', poster: '/half.png' });
    await page.evaluate("void (photo.style.width = '300px')");
    await waitUntil(page, "photo.shadowRoot.querySelector('[part=poster]').naturalWidth === 10");
    expect(await page.evaluate('photo.complete'), 'not loaded').toBe(false);
    await page.pdf();
    await waitForLoad(page);
    expect(await page.evaluate('scrollY')).toBe(0);
  });
});
