/**
 * Pictures of the element in each state, compared with tests/fixtures/visual. After an intended change, write new
 * pictures and look at them:
 *
 *     playwright test -c tests/browser screenshots --update-snapshots
 *
 * The photograph is drawn on the CPU. Texts have a font of the site, so that the fonts of a machine do not matter.
 */

import { expect, test } from './fixtures.js';
import { alertOf, mountPhoto, waitForFrames, waitForLoad, waitUntil } from './page-helpers.js';
import { LIGHTS } from './test-photos.js';

/** @typedef {import('@playwright/test').Page} Page */

/**
 * @typedef {object} State
 * @property {Record<string, string>} [attributes]
 * @property {number} [width] of the element, in pixels
 * @property {(page: Page) => Promise<unknown>} [enter] brings the element into the state
 * @property {NonNullable<Parameters<Page['emulateMedia']>[0]>} [media]
 */

const GLASS = { src: '/photos/glass.ltm', backend: 'cpu', alt: 'A window', light: 'torch' };
const CONTROLS_WIDTH_PX = 400;
const FONT =
  '@font-face { font-family: Screenshots; src: url(/fonts/source-serif-4.woff2) } ' +
  'relightable-photo { font-family: Screenshots }';

/**
 * Colour threshold of pixelmatch: 0.03 is a difference of 8/255 in brightness. A picture may have 0.2 % of pixels
 * above it, where edges are smoothed differently.
 */
const TOLERANCE = { threshold: 0.03, maxDiffPixelRatio: 0.002 };

/** @param {Page} page */
const waitForToolbar = async (page) => {
  await waitForLoad(page);
  await page.getByRole('toolbar').waitFor();
};
/** @param {Page} page */
const waitForAlert = (page) => alertOf(page).waitFor();
/** @param {Page} page */
const waitForPoster = async (page) => {
  await page.getByRole('button', { name: 'Light it yourself' }).waitFor();
  await waitUntil(page, "photo.shadowRoot.querySelector('[part=poster]').naturalWidth > 0");
};
/** @param {Page} page */
const focusLight = async (page) => {
  await waitForLoad(page);
  await page.keyboard.press('Tab');
  await expect(page.getByRole('slider')).toBeFocused();
};
/** @param {Page} page */
const focusToolbar = async (page) => {
  await waitForToolbar(page);
  await page.keyboard.press('Tab');
  await page.keyboard.press('Tab');
  await expect(page.getByRole('button', { name: 'Light: Torch' })).toBeFocused();
};

/** @type {State} */
const TOOLBAR = {
  attributes: { ...GLASS, controls: '', zoom: '' },
  width: CONTROLS_WIDTH_PX,
  enter: waitForToolbar,
};
/** @type {State} */
const POSTER = {
  attributes: { ...GLASS, poster: '/half.png', reveal: 'interaction' },
  width: CONTROLS_WIDTH_PX,
  enter: waitForPoster,
};
/** @type {State} */
const FAILING = {
  attributes: { ...GLASS, src: '/photos/absent.ltm' },
  width: CONTROLS_WIDTH_PX,
  enter: waitForAlert,
};

/** @type {State['media']} */
const DARK = { colorScheme: 'dark' };
/** @type {State['media']} */
const FORCED_COLOURS = { forcedColors: 'active' };

/** States by the part of the element that they are about. @type {Record<string, Record<string, State>>} */
const STATES = {
  light: {
    ...Object.fromEntries(
      LIGHTS.map((light) => [`light-${light}`, { attributes: { ...GLASS, light } }]),
    ),
    'torch-moved': {
      enter: async (page) => {
        await waitForLoad(page);
        await page.evaluate('void (photo.torch = { x: 0.2, y: 0.8 })');
      },
    },
    exposed: { attributes: { ...GLASS, light: 'flood', exposure: '0.5' } },
    'light-focus': { enter: focusLight },
    'light-focus-forced-colors': { enter: focusLight, media: FORCED_COLOURS },
  },
  toolbar: {
    toolbar: TOOLBAR,
    'toolbar-menu': {
      ...TOOLBAR,
      enter: async (page) => {
        await waitForToolbar(page);
        await page.getByRole('button', { name: 'Light: Torch' }).click();
        await page.getByRole('radiogroup', { name: 'Light' }).waitFor();
      },
    },
    'toolbar-focus': { ...TOOLBAR, enter: focusToolbar },
    'toolbar-dark': { ...TOOLBAR, media: DARK },
    'toolbar-forced-colors': { ...TOOLBAR, enter: focusToolbar, media: FORCED_COLOURS },
  },
  poster: {
    poster: POSTER,
    'poster-dark': { ...POSTER, media: DARK },
    'poster-forced-colors': { ...POSTER, media: FORCED_COLOURS },
  },
  error: {
    error: FAILING,
    'error-dark': { ...FAILING, media: DARK },
    'error-forced-colors': { ...FAILING, media: FORCED_COLOURS },
  },
};

test.describe('the element looks as before:', { tag: '@whole-browser' }, () => {
  for (const [part, states] of Object.entries(STATES)) {
    test(part, async ({ openPage, step }) => {
      const page = await openPage('/blank');
      for (const [name, state] of Object.entries(states)) {
        const { attributes = GLASS, width = 128, enter = waitForLoad, media } = state;
        await step(`the element looks as before: ${name}`, async () => {
          const usual = /** @type {const} */ ({ colorScheme: 'light', forcedColors: 'none' });
          await page.emulateMedia({ reducedMotion: 'reduce', ...usual, ...media });
          await page.goto('/plain');
          // Away from the element, which a state before may have clicked.
          await page.mouse.move(1000, 700);
          await mountPhoto(page, attributes);
          await page.evaluate(`void (photo.style.width = '${width}px')`);
          await page.addStyleTag({ content: FONT });
          await enter(page);
          await page.evaluate('document.fonts.ready.then(() => {})');
          // Frames in less than full quality are replaced before `toBlob` resolves.
          await page.evaluate('photo.toBlob().then(() => {}, () => {})');
          await waitForFrames(page, 2);
          await expect(page.locator('relightable-photo')).toHaveScreenshot(
            `${name}.png`,
            TOLERANCE,
          );
        });
      }
    });
  }
});
