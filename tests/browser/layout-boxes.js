/** Boxes in which the tests of every browser lay an element out, and where its picture must be in them. */

import { expect } from '@playwright/test';

/** @typedef {import('./any-browser.js').AnyPage} AnyPage */
/** @typedef {{ left: number, top: number, width: number, height: number }} Rect */

/**
 * @typedef {object} LayoutBox
 * @property {string} [around] CSS of the box around the element, which is 400 pixels wide
 * @property {string} [css] of the element
 * @property {Record<string, string>} [attributes]
 * @property {'dialog' | 'closed shadow root' | 'table cell'} [inside]
 * @property {[width: number, height: number]} [size] of the element, border to border
 */

/** The photograph is 128 pixels wide and 512 high. */
const SRC = '/photos/tall.ltm';
export const RATIO = 128 / 512;

const SIZE = { width: '100', height: '400' };

/** @type {Record<string, LayoutBox>} */
export const LAYOUT_BOXES = {
  'a block': { size: [400, 1600] },
  'a block with width and height': { attributes: SIZE, size: [100, 400] },
  'a block with a width': { attributes: { width: '64' }, size: [64, 256] },
  'a block with a height': { attributes: { height: '256' }, css: 'float: left', size: [64, 256] },
  'a narrower container': { attributes: { width: '800', height: '400' }, size: [400, 200] },
  'a width in CSS': { attributes: SIZE, css: 'width: 80px', size: [80, 320] },
  'a fixed height': { css: 'height: 200px', size: [400, 200] },
  'a fixed width and height': { css: 'width: 40px; height: 300px', size: [40, 300] },
  'an aspect ratio': { css: 'aspect-ratio: 2', size: [400, 200] },
  'a largest height': { css: 'max-height: 300px', size: [400, 300] },
  'a smallest height': { css: 'width: 10px; min-height: 300px', size: [10, 300] },
  'a relative height': { around: 'height: 240px', css: 'height: 50%', size: [400, 120] },
  'a float': { css: 'float: left', size: [128, 512] },
  'a float with width and height': { css: 'float: left', attributes: SIZE, size: [100, 400] },
  'an inline block': { css: 'display: inline-block', size: [128, 512] },
  'an inline block with width and height': {
    css: 'display: inline-block',
    attributes: SIZE,
    size: [100, 400],
  },
  'a padding': {
    css: 'box-sizing: border-box; padding: 10px 30px; width: 300px; height: 220px',
    size: [300, 220],
  },
  'a border': { css: 'border: 5px solid; width: 300px; height: 220px', size: [310, 230] },
  'a position': {
    around: 'position: relative; height: 200px',
    css: 'position: absolute; inset: 20px',
    size: [360, 160],
  },
  'a stretched grid cell': {
    around: 'display: grid; grid-template: 200px / 300px',
    size: [300, 200],
  },
  'an aligned grid cell': {
    around: 'display: grid; grid-template: 600px / 300px; place-items: center',
    size: [128, 512],
  },
  'a row of flex items': {
    around: 'display: flex; height: 200px',
    css: 'flex: 1',
    size: [400, 200],
  },
  'a column of flex items': {
    around: 'display: flex; flex-direction: column; height: 300px',
    css: 'flex: 1',
    size: [400, 300],
  },
  'a flex item of its own size': { around: 'display: flex; align-items: start', size: [128, 512] },
  'a table cell': { inside: 'table cell', attributes: SIZE, size: [100, 400] },
  'a dialog': { inside: 'dialog', attributes: SIZE, size: [100, 400] },
  'a dialog without a size': { inside: 'dialog', size: [128, 512] },
  'a closed shadow root': { inside: 'closed shadow root', css: 'height: 200px', size: [400, 200] },
};

/**
 * Adds an element in a box, as the page's global `photo`.
 *
 * @param {AnyPage} page
 * @param {LayoutBox} box
 */
export async function mountInBox(page, { around = '', css = '', attributes = {}, inside }) {
  await page.evaluate(
    async ({ around, css, attributes, inside }) => {
      await customElements.whenDefined('relightable-photo');
      document.querySelector('.box')?.remove();
      const box = document.createElement('div');
      box.className = 'box';
      box.style.cssText = `width: 400px; ${around}`;
      const photo = document.createElement('relightable-photo');
      for (const [name, value] of Object.entries(attributes)) photo.setAttribute(name, value);
      photo.style.cssText = css;
      /** @type {Element | ShadowRoot} */
      let parent = box;
      if (inside === 'closed shadow root') {
        parent = box.appendChild(document.createElement('div')).attachShadow({ mode: 'closed' });
      } else if (inside) {
        const tag = inside === 'dialog' ? 'dialog' : 'table';
        const outer = box.appendChild(document.createElement(tag));
        parent = outer instanceof HTMLTableElement ? outer.insertRow().insertCell() : outer;
      }
      parent.append(photo);
      document.body.append(box);
      box.querySelector('dialog')?.showModal();
      Object.assign(globalThis, { photo });
    },
    {
      around,
      css,
      inside,
      attributes: { src: SRC, backend: 'cpu', loading: 'eager', ...attributes },
    },
  );
}

/** Waits until the element has drawn its whole photograph. @param {AnyPage} page */
export const waitForPicture = (page) => page.evaluate('photo.ready.then(() => {})');

/**
 * The element's border box, its content box and the picture, in pixels of the page.
 *
 * @param {AnyPage} page
 * @returns {Promise<{ element: Rect, content: Rect, picture: Rect }>}
 */
export const layoutOf = (page) =>
  page.evaluate(() => {
    const { photo } = /** @type {any} */ (globalThis);
    const element = photo.getBoundingClientRect();
    const style = getComputedStyle(photo);
    const edge = (/** @type {string} */ side) =>
      Number.parseFloat(style.getPropertyValue(`border-${side}-width`)) +
      Number.parseFloat(style.getPropertyValue(`padding-${side}`));
    const content = {
      left: element.left + edge('left'),
      top: element.top + edge('top'),
      width: element.width - edge('left') - edge('right'),
      height: element.height - edge('top') - edge('bottom'),
    };
    const picture = photo.shadowRoot.querySelector('[part=picture]').getBoundingClientRect();
    return { element: element.toJSON(), content, picture: picture.toJSON() };
  });

/** Half a pixel on each side: layout may round. */
const MAX_ROUNDING_PX = 1;

/** @param {Rect} actual @param {Rect} expected @param {string} what */
export function expectRect(actual, expected, what) {
  for (const key of /** @type {const} */ (['left', 'top', 'width', 'height'])) {
    const message = `${what}: ${key} of ${JSON.stringify(actual)}, not ${JSON.stringify(expected)}`;
    expect(Math.abs(actual[key] - expected[key]), message).toBeLessThanOrEqual(MAX_ROUNDING_PX);
  }
}

/** The place of a picture that is contained in a box, in its middle. @param {Rect} box */
export function containedIn({ left, top, width, height }, ratio = RATIO) {
  const shown = Math.min(width, height * ratio);
  return {
    left: left + (width - shown) / 2,
    top: top + (height - shown / ratio) / 2,
    width: shown,
    height: shown / ratio,
  };
}

/**
 * Lays an element out in each box, and checks its size before and after loading, and the picture's place.
 *
 * @param {AnyPage} page
 * @param {import('./fixtures.js').Step} step
 */
export async function checkLayoutBoxes(page, step) {
  for (const [name, box] of Object.entries(LAYOUT_BOXES)) {
    await step(`an element contains its picture in ${name}`, async () => {
      await mountInBox(page, box);
      const before = await layoutOf(page);
      expect(before.element.width, 'it has a width before loading').toBeGreaterThan(0);
      expect(before.element.height, 'it has a height before loading').toBeGreaterThan(0);
      await waitForPicture(page);
      const { element, content, picture } = await layoutOf(page);
      const [width, height] = box.size ?? [element.width, element.height];
      expectRect(element, { ...element, width, height }, 'the element');
      expectRect(picture, containedIn(content), 'the picture');
      const { attributes = {} } = box;
      if (attributes['width'] && attributes['height']) {
        expectRect(before.element, element, 'the element before loading');
      }
    });
  }
}
