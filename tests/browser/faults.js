/** Every failure ends in an event with a code and a message on the screen. */

import assert from 'node:assert/strict';
import { describe, test } from 'node:test';
import { compare } from '../../www/tools/pictures.js';
import { details, happenedUntil, loaded, message, mount, openPage, picture } from './browser.js';
import { DAMAGED, nativePicture } from './photos.js';

/** @param {import('playwright-core').Page} page @param {string} code */
async function failsWith(page, code) {
  const error = (await happenedUntil(page, 'error')).find((event) => event.type === 'error');
  assert.equal(error?.['code'], code, String(error?.['message']));
  const text = String(error?.['message']);
  assert.match(text, /\S+ \S+ \S+/, 'a message people can read');
  await (await details(page)).getByText(text, { exact: true }).waitFor({ state: 'visible' });
  await page.getByRole('progressbar').waitFor({ state: 'hidden' });
  return text;
}

/** @type {[what: string, src: string, code: string, message: RegExp][]} */
const ANSWERS = [
  ['404', '/photos/absent.ltm', 'http-status', /absent\.ltm .*404/],
  ['503', '/faults/status', 'http-status', /503 Service Unavailable/],
  ['a web page', '/faults/html', 'http-type', /text\/html/],
  ['a body shorter than promised', '/faults/short', 'http-short', /incomplete/],
  ['a body that is cut', '/faults/cut', 'http-short', /incomplete/],
  [
    'a body without a length that is cut',
    '/faults/cut-silently',
    'http-short',
    /incomplete.* before byte \d+/,
  ],
  ['another file every time', '/faults/replaced', 'http-changed', /was replaced on the server/],
  ['other parts', '/faults/other-part', 'http-range', /bytes 0 to 16383, the server sent others/],
  ['no parts', '/faults/refused', 'http-range', /says that it has no bytes 0 to 16383/],
  ['nothing at all', '/faults/no-answer', 'http-network', /cannot be reached/],
  // Nothing listens on port 9 of this machine.
  ['no server', 'http://127.0.0.1:9/window.ltm', 'http-network', /window\.ltm .*cannot be reached/],
];

describe('a server that answers with', () => {
  for (const [what, src, code, text] of ANSWERS) {
    test(`${what} is ${code}`, async (t) => {
      const page = await openPage(t, '/bench');
      await mount(page, { src });
      assert.match(await failsWith(page, code), text);
    });
  }
});

describe('a file that is', () => {
  for (const [name, code] of Object.entries(DAMAGED)) {
    test(`${name.replace('.ltm', '')} is ${code}`, async (t) => {
      const page = await openPage(t, '/bench');
      await mount(page, { src: `/photos/${name}` });
      await failsWith(page, code);
    });
  }
});

describe('an attribute that is', () => {
  /** @type {[what: string, attributes: Record<string, string>, code: string, message: RegExp][]} */
  const cases = [
    ['an unknown light', { src: '/photos/glass.ltm', light: 'moon' }, 'attribute', /“moon”/],
    ['an unknown back end', { src: '/photos/glass.ltm', backend: 'gpu' }, 'attribute', /“gpu”/],
    ['no exposure', { src: '/photos/glass.ltm', exposure: 'much' }, 'attribute', /“much”/],
    [
      'too much exposure',
      { src: '/photos/glass.ltm', exposure: '1e300' },
      'attribute',
      /“1e300”.* 1e\+30/,
    ],
    ['no address', { src: 'http://[' }, 'attribute', /“http:\/\/\[”/],
    ['a missing src', {}, 'src-missing', /src is not set/],
  ];
  for (const [what, attributes, code, text] of cases) {
    test(`${what} is ${code}`, async (t) => {
      const page = await openPage(t, '/bench');
      await mount(page, attributes);
      assert.match(await failsWith(page, code), text);
    });
  }

  test('wrong for a while leaves the picture, and its message goes once it is right', async (t) => {
    const page = await openPage(t, '/bench');
    await mount(page, { src: '/photos/glass.ltm', light: 'flood' });
    await loaded(page);
    await page.evaluate("photo.light = 'moon'");
    await failsWith(page, 'attribute');
    assert.equal(await page.locator('relightable-photo canvas').count(), 1);
    await page.evaluate("photo.light = 'stripes'");
    await message(page).waitFor({ state: 'hidden' });
    const happened = await page.evaluate('happened');
    assert.equal(happened.filter((/** @type {any} */ e) => e.type === 'error').length, 1);
  });

  test('wrong takes nothing else along', async (t) => {
    const page = await openPage(t, '/bench');
    await mount(page, { src: '/photos/glass.ltm', light: 'moon', exposure: 'much' });
    await happenedUntil(page, 'load');
    await page.evaluate("photo.light = 'torch', photo.torch = { x: 0.2, y: 0.4 }");
    await page.evaluate("photo.tone = 'hdr', photo.src = 'http://['");
    await page.waitForFunction("happened.filter(({ type }) => type === 'error').length === 4");
    const happened = await page.evaluate('happened');
    const told = happened.filter((/** @type {any} */ e) => e.type === 'error');
    assert.deepEqual(
      told.map((/** @type {any} */ e) => /“(.*?)”/.exec(e.message)?.[1]),
      ['moon', 'much', 'hdr', 'http://['],
    );
    const changes = happened.filter((/** @type {any} */ e) => e.type === 'lightchange');
    assert.deepEqual(changes.at(-1)?.torch, { x: 0.2, y: 0.4 });
    assert.equal(await page.locator('relightable-photo canvas').count(), 1);
    assert.equal(happened.filter((/** @type {any} */ e) => e.type === 'load').length, 1);
  });
});

describe('a page that is', () => {
  test('without the wasm folder is wasm-unavailable', async (t) => {
    const page = await openPage(t, '/bench');
    await page.route('**/wasm/*', (route) => route.fulfill({ status: 404, body: 'gone' }));
    await mount(page, { src: '/photos/glass.ltm' });
    await failsWith(page, 'wasm-unavailable');
  });

  test('without the script that draws is backend-unavailable, and tells which', async (t) => {
    const page = await openPage(t, '/bench');
    await page.route('**/relightable-photo-cpu.js', (route) => route.fulfill({ status: 404 }));
    await mount(page, { src: '/photos/glass.ltm', backend: 'cpu' });
    assert.match(await failsWith(page, 'backend-unavailable'), /relightable-photo-cpu\.js/);
  });

  test('without the script that lights by pictures keeps its light, and has light-source', async (t) => {
    const page = await openPage(t, '/bench');
    await page.route('**/relightable-photo-sources.js', (route) => route.fulfill({ status: 404 }));
    await mount(page, {
      src: '/photos/glass.ltm',
      'light-src': '/site/icon.svg',
      light: 'stripes',
    });
    const happened = await happenedUntil(page, 'load');
    const error = happened.find(({ type }) => type === 'error');
    assert.equal(error?.['code'], 'light-source');
    assert.match(String(error?.['message']), /relightable-photo-sources\.js/);
    const want = nativePicture('stripes', 'reference');
    assert.ok(compare(await picture(page), want).worst <= 1);
  });

  test('without the script of the buttons is controls-unavailable, and all else works', async (t) => {
    const page = await openPage(t, '/bench');
    await page.route('**/relightable-photo-controls.js', (route) => route.abort());
    await mount(page, { src: '/photos/glass.ltm', controls: '', light: 'stripes' });
    await happenedUntil(page, 'load');
    const error = (await happenedUntil(page, 'error')).find(({ type }) => type === 'error');
    assert.equal(error?.['code'], 'controls-unavailable');
    const want = nativePicture('stripes', 'reference');
    assert.ok(compare(await picture(page), want).worst <= 1);
  });

  for (const [what, policy, code, text] of /** @type {const} */ ([
    [
      'not allowed to fetch',
      "default-src 'self' 'unsafe-inline' 'wasm-unsafe-eval'; connect-src 'self'",
      'csp-connect',
      /window\.ltm .*http:\/\/127\.0\.0\.1:9 in connect-src/,
    ],
    [
      'not allowed to run WebAssembly',
      "default-src 'self' 'unsafe-inline'",
      'csp-wasm',
      /'wasm-unsafe-eval' in script-src/,
    ],
  ])) {
    test(`${what} is ${code}`, async (t) => {
      const page = await openPage(t, '/blank', { refusal: /violates|Refused|CompileError/ });
      await page.route('**/bench', async (route) => {
        const response = await route.fetch();
        const headers = { ...response.headers(), 'content-security-policy': policy };
        await route.fulfill({ response, headers });
      });
      await page.goto('/bench');
      const src = code === 'csp-connect' ? 'http://127.0.0.1:9/window.ltm' : '/photos/glass.ltm';
      await mount(page, { src });
      assert.match(await failsWith(page, code), text);
    });
  }

  test('asking for a picture too early is told so', async (t) => {
    const page = await openPage(t, '/bench');
    await mount(page, { src: '/faults/slow' });
    const code = await page.evaluate('photo.toBlob().catch((error) => error.code)');
    assert.equal(code, 'not-loaded');
  });
});
