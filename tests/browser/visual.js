/**
 * What the element looks like, pixel by pixel, against tests/fixtures/visual. After a change that is meant to
 * be seen, look at the pictures and take them over with
 *
 *     UPDATE_VISUAL=1 node --test tests/browser/visual.js
 *
 * What is off is in target/visual: NAME.png as it is, NAME-difference.png with white where it differs.
 */

import assert from 'node:assert/strict';
import { existsSync, mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { describe, test } from 'node:test';
import { decodePng, differing, encodePng } from '../../www/tools/pictures.js';
import { loaded, mount, openPage } from './browser.js';
import { LIGHTS } from './photos.js';

/** @typedef {import('playwright-core').Page} Page */

const REFERENCES = join(import.meta.dirname, '../fixtures/visual');
const OUT = join(import.meta.dirname, '../../target/visual');
const UPDATE = Boolean(process.env['UPDATE_VISUAL']);
const WIDTH = 128;
/** Codes that scaling and rounding may move a pixel by. */
const TOLERANCE = 8;
/** The share of pixels that may differ by more: edges, where they are smoothed otherwise. */
const MOST = 0.002;

/**
 * @typedef {object} State
 * @property {Record<string, string>} attributes
 * @property {(page: Page) => Promise<unknown>} [reach] brings it about once the photograph is shown
 * @property {'light' | 'dark'} [page] the page's colours
 * @property {string[]} [mask] what is inside the element and not to be compared, as text is not, by selector
 */

const GLASS = { src: '/photos/glass.ltm', backend: 'cpu', alt: 'A window' };

/** A state more is a line more. @type {Record<string, State>} */
const STATES = {
  ...Object.fromEntries(
    LIGHTS.map((light) => [`light-${light}`, { attributes: { ...GLASS, light } }]),
  ),
  'torch-moved': {
    attributes: { ...GLASS, light: 'torch' },
    reach: (page) => page.evaluate('void (photo.torch = { x: 0.2, y: 0.8 })'),
  },
  exposed: { attributes: { ...GLASS, light: 'flood', exposure: '0.5' } },
};

mkdirSync(OUT, { recursive: true });
mkdirSync(REFERENCES, { recursive: true });

describe('what the element looks like:', () => {
  for (const [
    name,
    { attributes, reach, page: colorScheme = 'light', mask = [] },
  ] of Object.entries(STATES)) {
    test(name, async (t) => {
      const page = await openPage(t, '/bench', { colorScheme, reducedMotion: 'reduce' });
      await mount(page, attributes);
      await page.evaluate(`void (photo.style.width = '${WIDTH}px')`);
      await loaded(page);
      await reach?.(page);
      // The exact picture, and two frames for it to reach the screen.
      await page.evaluate(async () => {
        await /** @type {any} */ (globalThis).photo.toBlob();
        for (let i = 0; i < 2; i += 1) await new Promise((next) => requestAnimationFrame(next));
      });
      const photo = page.locator('relightable-photo');
      const shown = await photo.screenshot({ mask: mask.map((part) => photo.locator(part)) });
      const reference = join(REFERENCES, `${name}.png`);
      if (UPDATE) writeFileSync(reference, encodePng(decodePng(shown)));
      assert.ok(existsSync(reference), `there is no ${reference}: see how at the top of this file`);
      const [is, want] = [decodePng(shown), decodePng(readFileSync(reference))];
      writeFileSync(join(OUT, `${name}.png`), shown);
      const { count, difference } = differing(is, want, TOLERANCE);
      writeFileSync(join(OUT, `${name}-difference.png`), encodePng(difference));
      assert.ok(
        count <= MOST * is.width * is.height,
        `${count} pixels differ by more than ${TOLERANCE}/255; see target/visual/${name}.png`,
      );
    });
  }
});
