/** What scripts and style sheets learn about loading: `complete`, `error`, `ready`, `load()` and `:state()`. */

import { expect, test } from './fixtures.js';
import { countEvents, mountPhoto, waitForEvents, waitForLoad, waitUntil } from './page-helpers.js';

/** @typedef {import('@playwright/test').Page} Page */

const GLASS = '/photos/glass.ltm';
const PHASES = ['loading', 'ready', 'error'];

/** The element's state: `complete`, the error's code, and the states that match. @param {Page} page */
function statusOf(page) {
  return page.evaluate((phases) => {
    const { photo } = /** @type {any} */ (globalThis);
    const states = phases.filter((phase) => photo.matches(`:state(${phase})`));
    return [photo.complete, photo.error?.code ?? null, ...states];
  }, PHASES);
}

test.describe('a photograph', () => {
  test('that loads is complete, and resolves ready to the element', async ({ openPage }) => {
    const page = await openPage('/plain');
    await mountPhoto(page, { src: GLASS, loading: 'lazy', hidden: '' });
    expect(await statusOf(page), 'not fetched yet').toStrictEqual([false, null]);
    await page.evaluate('globalThis.first = photo.ready, photo.hidden = false');
    await waitForLoad(page);
    expect(await statusOf(page)).toStrictEqual([true, null, 'ready']);
    expect(await page.evaluate('first.then((value) => value === photo)')).toBe(true);
    expect(await page.evaluate('photo.ready === first')).toBe(true);
    const next = 'photo.load(), [photo.complete, photo.ready === first]';
    expect(await page.evaluate(next), 'the next load').toStrictEqual([false, false]);
    expect(await page.evaluate('photo.ready.then((value) => value === photo)')).toBe(true);
    expect(await countEvents(page, 'load')).toBe(2);
  });

  test('that fails rejects ready, and can be loaded again', async ({ openPage }) => {
    const page = await openPage('/plain');
    await page.route('**/glass.ltm', (route) => route.fulfill({ status: 404 }));
    await mountPhoto(page, { src: GLASS });
    await waitForEvents(page, 'error');
    expect(await statusOf(page)).toStrictEqual([true, 'http-status', 'error']);
    const code = await page.evaluate('photo.ready.catch((error) => error.code)');
    expect(code).toBe('http-status');
    await page.unroute('**/glass.ltm');
    await page.evaluate('photo.load()');
    await waitForEvents(page, 'load');
    expect(await statusOf(page)).toStrictEqual([true, null, 'ready']);
    await expect(page.getByRole('alert')).toBeHidden();
  });

  test('keeps its status when its next address is invalid', async ({ openPhoto }) => {
    const page = await openPhoto({ src: GLASS });
    await page.evaluate("photo.src = 'http://['");
    await waitForEvents(page, 'warning');
    expect(await statusOf(page)).toStrictEqual([true, null, 'ready']);
    await page.evaluate("photo.removeAttribute('src')");
    await waitForEvents(page, 'error');
    expect(await statusOf(page)).toStrictEqual([true, 'src-missing', 'error']);
  });

  test('that is removed has no status, and loads again when it returns', async ({ openPhoto }) => {
    const page = await openPhoto({ src: GLASS });
    await page.evaluate('photo.remove()');
    await waitUntil(page, '!photo.complete');
    expect(await statusOf(page)).toStrictEqual([false, null]);
    await page.evaluate('void document.body.append(photo)');
    expect(await page.evaluate('photo.ready.then((value) => value.complete)')).toBe(true);
  });
});

test('events do not bubble', async ({ openPage }) => {
  const page = await openPage('/plain');
  await page.evaluate(() => {
    /** @type {string[]} */
    const heard = [];
    for (const type of ['load', 'error', 'progress', 'warning', 'lightchange', 'backendchange']) {
      addEventListener(type, (event) => heard.push(event.type));
    }
    Object.assign(globalThis, { heard });
  });
  await mountPhoto(page, { src: GLASS, tone: 'bright' });
  await waitForLoad(page);
  await page.evaluate("photo.light = 'fire'");
  await waitForEvents(page, 'lightchange');
  await page.evaluate("photo.src = '/absent.ltm'");
  await waitForEvents(page, 'error');
  expect(await page.evaluate('heard')).toStrictEqual([]);
});

test('play and pause control the fire; paused is read-only', async ({ openPhoto }) => {
  const page = await openPhoto({ src: GLASS, light: 'fire' });
  const states = await page.evaluate(() => {
    const { photo } = /** @type {any} */ (globalThis);
    const states = [photo.paused];
    photo.pause();
    states.push(photo.paused);
    photo.play();
    states.push(photo.paused);
    return [...states, Reflect.set(photo, 'paused', true)];
  });
  expect(states).toStrictEqual([false, true, false, false]);
});
