/** Failures are errors with a message on the picture's place if there is no picture, and otherwise only warnings. */

import { expect, test } from './fixtures.js';
import {
  capturePicture,
  countEvents,
  mountPhoto,
  openAlertDetails,
  skipPausesUntil,
  waitForEvents,
  waitForWarning,
  waitUntil,
} from './page-helpers.js';
import { DAMAGED, nativePicture } from './test-photos.js';

/** @param {import('@playwright/test').Page} page @param {string} code */
async function expectError(page, code) {
  const error = (await waitForEvents(page, 'error')).find((event) => event.type === 'error');
  expect(error?.['code'], String(error?.['message'])).toBe(code);
  const text = String(error?.['message']);
  expect(text, 'a sentence').toMatch(/\S+ \S+ \S+/);
  await (await openAlertDetails(page))
    .getByText(text, { exact: true })
    .waitFor({ state: 'visible' });
  await page.getByRole('progressbar').waitFor({ state: 'hidden' });
  return text;
}

/** @type {[what: string, src: string, code: string, message: RegExp][]} */
const ANSWERS = [
  ['404', '/photos/absent.ltm', 'http-status', /absent\.ltm .*404/],
  ['503', '/faults/status', 'http-status', /503 Service Unavailable/],
  ['a web page', '/faults/html', 'http-type', /text\/html/],
  ['a body shorter than Content-Length', '/faults/short', 'http-short', /incomplete/],
  ['a chunked body that ends early', '/faults/cut', 'http-short', /incomplete/],
  [
    'a body without a length that ends early',
    '/faults/cut-silently',
    'http-short',
    /incomplete.* before byte \d+/,
  ],
  [
    'a new version of the file each time',
    '/faults/replaced',
    'http-changed',
    /was replaced on the server/,
  ],
  [
    'another range',
    '/faults/other-part',
    'http-range',
    /bytes 0 to 16383 were requested, but the server sent others/,
  ],
  [
    '416 for the first range',
    '/faults/refused',
    'http-range',
    /says that it has no bytes 0 to 16383/,
  ],
  ['no response', '/faults/no-answer', 'http-network', /cannot be reached/],
  // No server listens on port 9.
  [
    'nothing, as it does not run',
    'http://127.0.0.1:9/window.ltm',
    'http-network',
    /window\.ltm .*cannot be reached/,
  ],
];

test('a server that sends no whole photograph causes an error', async ({ openPage, step }) => {
  // The element sends most of these requests again after pauses.
  const page = await openPage('/blank', { fakeClock: true });
  for (const [what, src, code, text] of ANSWERS) {
    await step(`a server that sends ${what} causes ${code}`, async () => {
      await page.goto('/plain');
      await skipPausesUntil(page, 'error', () => mountPhoto(page, { src }));
      expect(await expectError(page, code)).toMatch(text);
    });
  }
});

test('a damaged file causes an error', async ({ openPage, step }) => {
  const page = await openPage('/blank');
  for (const [name, code] of Object.entries(DAMAGED)) {
    await step(`a file that is ${name.replace('.ltm', '')} causes ${code}`, async () => {
      await page.goto('/plain');
      await mountPhoto(page, { src: `/photos/${name}` });
      await expectError(page, code);
    });
  }
});

test.describe('an invalid attribute', () => {
  /** @type {[what: string, attributes: Record<string, string>, code: string, message: RegExp][]} */
  const cases = [
    [
      'that names an unknown light',
      { src: '/photos/glass.ltm', light: 'moon' },
      'attribute',
      /“moon”/,
    ],
    [
      'that names an unknown backend',
      { src: '/photos/glass.ltm', backend: 'gpu' },
      'attribute',
      /“gpu”/,
    ],
    [
      'whose exposure is no number',
      { src: '/photos/glass.ltm', exposure: 'much' },
      'attribute',
      /“much”/,
    ],
    [
      'whose exposure is too large',
      { src: '/photos/glass.ltm', exposure: '1e300' },
      'attribute',
      /“1e300”.* 1e\+30/,
    ],
  ];
  test('causes a warning in an event and in the console, not on the picture', async ({
    openPage,
    step,
  }) => {
    const page = await openPage('/blank');
    /** @type {string[]} */
    const logged = [];
    page.on('console', (message) => logged.push(`${message.type()} ${message.text()}`));
    for (const [what, attributes, code, text] of cases) {
      await step(`an attribute ${what} causes ${code}`, async () => {
        await page.goto('/plain');
        await mountPhoto(page, attributes);
        const warning = await waitForWarning(page);
        expect(warning['code']).toBe(code);
        expect(String(warning['message'])).toMatch(text);
        expect(logged.at(-1)).toBe(`warning <relightable-photo> ${code}: ${warning['message']}`);
        await waitForEvents(page, 'load');
      });
    }
  });

  test('of the address causes an error if there is no picture', async ({ openPage, step }) => {
    const page = await openPage('/blank');
    for (const [attributes, code, text] of /** @type {const} */ ([
      [{ src: 'http://[' }, 'attribute', /“http:\/\/\[”/],
      [{}, 'src-missing', /set the src attribute/],
    ])) {
      await step(code, async () => {
        await page.goto('/plain');
        await mountPhoto(page, attributes);
        expect(await expectError(page, code)).toMatch(text);
        expect(await countEvents(page, 'warning')).toBe(0);
      });
    }
  });

  test('does not affect the other attributes', async ({ openPage }) => {
    const page = await openPage('/plain');
    await mountPhoto(page, { src: '/photos/glass.ltm', light: 'moon', exposure: 'much' });
    await waitForEvents(page, 'load');
    await page.evaluate("photo.setAttribute('light', 'torch'), photo.torch = { x: 0.2, y: 0.4 }");
    await page.evaluate("photo.tone = 'hdr', photo.src = 'http://['");
    await waitUntil(page, "photoEvents.filter(({ type }) => type === 'warning').length === 4");
    const photoEvents = await page.evaluate('photoEvents');
    const told = photoEvents.filter((/** @type {any} */ e) => e.type === 'warning');
    expect(told.map((/** @type {any} */ e) => /“(.*?)”/.exec(e.message)?.[1])).toStrictEqual([
      'moon',
      'much',
      'http://[',
      'hdr',
    ]);
    const changes = photoEvents.filter((/** @type {any} */ e) => e.type === 'lightchange');
    expect(changes.at(-1)?.torch).toStrictEqual({ x: 0.2, y: 0.4 });
    expect(await page.locator('relightable-photo canvas').count()).toBe(1);
    expect(photoEvents.filter((/** @type {any} */ e) => e.type === 'load').length).toBe(1);
  });
});

test.describe('a page', () => {
  test('without the WebAssembly modules causes wasm-unavailable', async ({ openPage }) => {
    const page = await openPage('/plain');
    await page.route('**/wasm/*', (route) => route.fulfill({ status: 404, body: 'gone' }));
    await mountPhoto(page, { src: '/photos/glass.ltm' });
    await expectError(page, 'wasm-unavailable');
  });

  test('without the script of the CPU renderer causes backend-unavailable and names the script', async ({
    openPage,
  }) => {
    const page = await openPage('/plain');
    await page.route('**/relightable-photo-cpu.js', (route) => route.fulfill({ status: 404 }));
    await mountPhoto(page, { src: '/photos/glass.ltm', backend: 'cpu' });
    expect(await expectError(page, 'backend-unavailable')).toMatch(/relightable-photo-cpu\.js/);
  });

  test('without the script of the light sources causes light-source and keeps its built-in light', async ({
    openPage,
  }) => {
    const page = await openPage('/plain');
    await page.route('**/relightable-photo-sources.js', (route) => route.fulfill({ status: 404 }));
    await mountPhoto(page, {
      src: '/photos/glass.ltm',
      'light-src': '/site/icon.svg',
      light: 'stripes',
    });
    const photoEvents = await waitForEvents(page, 'load');
    const warning = photoEvents.find(({ type }) => type === 'warning');
    expect(warning?.['code']).toBe('light-source');
    expect(String(warning?.['message'])).toMatch(/relightable-photo-sources\.js/);
    const want = nativePicture('stripes');
    expect(await capturePicture(page)).toMatchPicture(want, 1);
  });

  test('without the script of the toolbar causes controls-unavailable and still draws', async ({
    openPage,
  }) => {
    const page = await openPage('/plain');
    await page.route('**/relightable-photo-controls.js', (route) => route.abort());
    await mountPhoto(page, { src: '/photos/glass.ltm', controls: '', light: 'stripes' });
    await waitForEvents(page, 'load');
    expect((await waitForWarning(page))['code']).toBe('controls-unavailable');
    const want = nativePicture('stripes');
    expect(await capturePicture(page)).toMatchPicture(want, 1);
  });

  test('without the script for input causes input-unavailable and still draws', async ({
    openPage,
  }) => {
    const page = await openPage('/plain');
    await page.route('**/relightable-photo-input.js', (route) => route.abort());
    await mountPhoto(page, { src: '/photos/glass.ltm', light: 'stripes' });
    await waitForEvents(page, 'load');
    expect((await waitForWarning(page))['code']).toBe('input-unavailable');
    expect(await capturePicture(page)).toMatchPicture(nativePicture('stripes'), 1);
    expect(await page.evaluate('photo.requestTilt()')).toBe(false);
  });

  for (const [what, policy, code, text] of /** @type {const} */ ([
    [
      'whose policy forbids the photograph’s address',
      "default-src 'self' 'unsafe-inline' 'wasm-unsafe-eval'; connect-src 'self'",
      'csp-connect',
      /window\.ltm .*http:\/\/127\.0\.0\.1:9 to connect-src/,
    ],
    [
      'whose policy forbids WebAssembly',
      "default-src 'self' 'unsafe-inline'",
      'csp-wasm',
      /'wasm-unsafe-eval' to script-src/,
    ],
  ])) {
    test(`${what} causes ${code}`, async ({ openPage }) => {
      const page = await openPage('/blank', { expectedMessages: /violates|Refused|CompileError/ });
      await page.route('**/plain', async (route) => {
        const response = await route.fetch();
        const headers = { ...response.headers(), 'content-security-policy': policy };
        await route.fulfill({ response, headers });
      });
      await page.goto('/plain');
      const src = code === 'csp-connect' ? 'http://127.0.0.1:9/window.ltm' : '/photos/glass.ltm';
      await mountPhoto(page, { src });
      expect(await expectError(page, code)).toMatch(text);
    });
  }

  test('that calls toBlob before the photograph has loaded gets not-loaded', async ({
    openPage,
  }) => {
    const page = await openPage('/plain');
    await mountPhoto(page, { src: '/faults/slow' });
    const code = await page.evaluate('photo.toBlob().catch((error) => error.code)');
    expect(code).toBe('not-loaded');
  });
});
