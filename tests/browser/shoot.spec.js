/**
 * A session of `ltm-export shoot`: the page shows the pictures, a stand-in camera photographs the page's real screenshots with
 * faults, and what goes wrong is photographed again.
 */

import { execFile, execFileSync, spawn } from 'node:child_process';
import { once } from 'node:events';
import {
  existsSync,
  mkdtempSync,
  readFileSync,
  rmSync,
  truncateSync,
  writeFileSync,
} from 'node:fs';
import { createServer, get } from 'node:http';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { promisify } from 'node:util';
import { expect, test } from './fixtures.js';

const PROGRAM = join(import.meta.dirname, '../../target/release/ltm-export');
const DISPLAY = { width: 320, height: 240 };
/** Pictures before the Gray code: dark, flood and ramp. */
const FIRST_GRAY_CODE = 10;
const FIRST_PATTERN = FIRST_GRAY_CODE + 16;

/** @param {string[]} args */
const ltmExport = (...args) => execFileSync(PROGRAM, args, { stdio: 'pipe', encoding: 'utf8' });

/** An object, the pictures of a display, and a camera that photographs a page. */
class Studio {
  folder = mkdtempSync(join(tmpdir(), 'shoot-'));
  /** Screenshots so far. @type {Buffer[]} */
  screenshots = [];
  /** Photographs of each picture so far. @type {Map<number, number>} */
  attempts = new Map();
  /** What goes wrong with an attempt at a picture. @type {(number: number, attempt: number) => string | undefined} */
  fault = () => undefined;
  /** The photograph that is being taken. @type {Promise<string | undefined>} */
  photographing = Promise.resolve(undefined);
  /** Factor of the light. */
  light = 1;
  /** @type {import('@playwright/test').Page | undefined} */
  page;

  async open() {
    const size = ['--camera', '48x48', '--light', '16x16', '--patterns', '1'];
    ltmExport('simulate', 'stained-glass', '-o', this.path('object'), ...size);
    const display = ['--screen', '320x240', '--light', '16x16', '--patterns', '24'];
    ltmExport('patterns', '-o', this.path('session'), ...display);
    this.server = createServer(async (request, response) => {
      const url = new URL(request.url ?? '', 'http://localhost');
      this.photographing = this.photograph(url.searchParams).catch(String);
      response.end((await this.photographing) ?? '');
    });
    this.server.listen(0, '127.0.0.1');
    await once(this.server, 'listening');
    const { port } = /** @type {import('node:net').AddressInfo} */ (this.server.address());
    const script = `
      const [file, number, exposure] = process.argv.slice(2);
      const query = new URLSearchParams({ file, number, exposure });
      const failure = await (await fetch('http://127.0.0.1:${port}/?' + query)).text();
      if (failure) throw new Error(failure);`;
    writeFileSync(this.path('camera.mjs'), script);
  }

  close() {
    this.server?.close();
    rmSync(this.folder, { recursive: true, force: true });
  }

  /** @param {string} name */
  path(name) {
    return join(this.folder, name);
  }

  /** Photographs what the page shows. @param {URLSearchParams} query */
  async photograph(query) {
    const number = Number(query.get('number'));
    const file = query.get('file') ?? '';
    const attempt = (this.attempts.get(number) ?? 0) + 1;
    this.attempts.set(number, attempt);
    this.screenshots.push((await this.page?.screenshot()) ?? Buffer.alloc(0));
    const fault = this.fault(number, attempt);
    if (fault === 'no file') return undefined;
    if (fault === 'camera') return 'the battery is empty';
    // The first is of the flood.
    const shown = { late: -2, flood: 0 }[fault ?? ''] ?? -1;
    const screenshot = this.screenshots.at(shown);
    writeFileSync(this.path('screen.png'), screenshot ?? '');
    const [above, below] = (query.get('exposure') || '1/15').split('/').map(Number);
    const factor = this.light * (fault === 'dark' ? 0.3 : 1);
    const seconds = (factor * (above ?? 1)) / (below ?? 1);
    const object = [this.path('object'), '--sequence', this.path('session')];
    const picture = ['--picture', this.path('screen.png'), '--exposure', String(seconds)];
    const args = [
      'photograph',
      ...object,
      ...picture,
      '-o',
      file,
      '--seed',
      String(100 * attempt + number),
    ];
    await promisify(execFile)(PROGRAM, args);
    if (fault === 'truncated') truncateSync(file, 3000);
    return undefined;
  }

  /** The arguments of a session. @param {string[]} options */
  arguments(options) {
    const exposure = options.includes('--exposures') ? '{exposure}' : '1/15';
    const camera = `node ${this.path('camera.mjs')} {file} {number} ${exposure}`;
    const levels = ['--black', '512', '--white', '60000', '--settle', '0.05', '--port', '0'];
    return ['shoot', this.path('session'), '--camera', camera, ...levels, ...options];
  }

  /** What a session that is refused says. @param {string[]} options */
  async refusal(...options) {
    const program = promisify(execFile)(PROGRAM, this.arguments(options));
    return program.then(
      () => 'it was not refused',
      (error) => error.stderr,
    );
  }

  /** Starts a session, and waits for its page's address. @param {string[]} options */
  async shoot(...options) {
    const program = spawn(PROGRAM, this.arguments(options), { stdio: ['ignore', 'pipe', 'pipe'] });
    let text = '';
    program.stderr.setEncoding('utf8').on('data', (chunk) => {
      text += chunk;
    });
    const ended = once(program, 'close').then(([code]) => ({ code, text }));
    await expect.poll(() => text).toMatch(/open http:\S+ in a browser/);
    const url = /open (http:\S+)/.exec(text)?.[1] ?? '';
    return { program, url, ended, text: () => text };
  }

  /** @param {import('@playwright/test').Browser} browser @param {string} url */
  async show(browser, url) {
    const context = await browser.newContext({ viewport: DISPLAY });
    this.page = await context.newPage();
    await this.page.goto(url);
    await this.page.click('#here');
  }
}

/** @type {Studio} */
let studio;
test.beforeEach(async () => {
  studio = new Studio();
  await studio.open();
});
test.afterEach(() => studio.close());

const EXPOSURES = ['--exposures', '1/480,1/240,1/120,1/60,1/30,1/15,1/8,1/4'];

test('a session with faults becomes a capture, and what went wrong is photographed again', async ({
  browser,
}) => {
  test.setTimeout(300_000);
  /** @type {Record<number, string>} */
  const faults = {
    3: 'no file',
    6: 'late',
    [FIRST_GRAY_CODE + 4]: 'truncated',
    [FIRST_GRAY_CODE + 7]: 'late',
    [FIRST_GRAY_CODE + 10]: 'late',
    [FIRST_PATTERN + 2]: 'late',
    [FIRST_PATTERN + 5]: 'dark',
    [FIRST_PATTERN + 8]: 'camera',
  };
  // Before the session, the dark picture is photographed twice after the flood; if the first shows that, twice more.
  /** @type {Record<number, string>} */
  const darkFaults = { 1: 'late', 5: 'flood' };
  studio.fault = (number, attempt) => {
    if (number === 0) return darkFaults[attempt];
    return attempt === 1 ? faults[number] : undefined;
  };
  studio.light = 2.5;
  const session = await studio.shoot(...EXPOSURES);
  await studio.show(browser, session.url);
  const { code, text } = await session.ended;
  expect(code, text).toBe(0);
  // A tenth of the object's own light is too dark, and three times as much saturates.
  expect(text).toContain('exposure 1/60 s');
  for (const part of [
    'the dark picture has 99.9 % of its light left: photographs wait for 0.10 seconds',
    'the flood is hardly brighter than the dark photograph',
    'wrote no photograph',
    'is not between its neighbours in brightness, as display/0006-ramp-128.png is',
    'display/0028-pattern-0002.png: the photograph shows display/',
    'the battery is empty',
    'is not the inverse of the photograph before',
    'shots of 48x48 pixels',
  ]) {
    expect(text).toContain(part);
  }
  expect(text).toMatch(/pattern-0005.png is 0\.(29|3\d) times as bright as expected/);
  const log = JSON.parse(readFileSync(studio.path('session/shooting.json'), 'utf8'));
  const { attempts } = log.photographs[FIRST_PATTERN + 2];
  expect(attempts).toBe(2);
  // The dark photograph and the plain Gray code were taken again, because others did not fit them.
  expect(studio.attempts.get(0)).toBe(6);
  expect(studio.attempts.get(FIRST_GRAY_CODE + 10)).toBe(2);
  expect(log.settle_seconds).toBeCloseTo(0.1);
  expect(log.photographs[FIRST_PATTERN + 1].attempts).toBe(1);
  await expect(studio.page?.locator('#message') ?? fail()).toContainText(
    'All photographs are taken',
  );
  expect(await studio.refusal(...EXPOSURES)).toContain('all photographs of this session are taken');
  // Photographs, their originals, and nothing else remain.
  expect(existsSync(studio.path('session/.shoot'))).toBe(false);
  expect(existsSync(studio.path('session/originals/0028-pattern-0002.png'))).toBe(true);
  const file = studio.path('object.ltm');
  ltmExport('check', studio.path('session'), '--strict');
  ltmExport('recover', studio.path('session'), '-o', file, '--patterns', '20', '--window', '9');
  const report = JSON.parse(ltmExport('evaluate', file, studio.path('session'), '--json'));
  expect(report.heldout_snr_db).toBeGreaterThan(18);
});

test('a session goes on after an interruption, a reload and a closed page', async ({ browser }) => {
  test.setTimeout(300_000);
  const first = await studio.shoot(...EXPOSURES);
  await studio.show(browser, first.url);
  const taken = () => studio.attempts.size;
  await expect.poll(taken).toBeGreaterThan(12);
  // Playwright takes no screenshot of a page that it reloads.
  await studio.photographing;
  await studio.page?.reload();
  const afterReload = taken();
  await studio.page?.click('#here');
  await expect.poll(taken).toBeGreaterThan(afterReload + 3);
  first.program.kill('SIGINT');
  const interrupted = await first.ended;
  expect(interrupted.code).toBe(130);
  expect(interrupted.text).toMatch(/interrupted: \d+ of 58 photographs are kept/);
  await studio.page?.context().close();
  const refused = await studio.refusal(...EXPOSURES, '--bin', '2');
  expect(refused).toContain('was begun with another --bin, 1');
  const second = await studio.shoot(...EXPOSURES);
  await studio.show(browser, second.url);
  const { code, text } = await second.ended;
  expect(code, text).toBe(0);
  // Photographs are not taken again, nor are exposure and delay searched, but where the reload and the interruption came.
  expect(text).not.toContain('exposure 1/');
  expect(studio.attempts.get(0)).toBe(3);
  const again = [...studio.attempts].filter(([number, count]) => number > 1 && count > 1);
  expect(again.length).toBeLessThanOrEqual(2);
  ltmExport('check', studio.path('session'), '--strict');
});

test('the operator is asked for the exposure, and pages of other servers are refused', async ({
  browser,
}) => {
  studio.light = 0.1;
  const session = await studio.shoot();
  for (const [host, status] of /** @type {const} */ ([
    ['museum.example', 403],
    [new URL(session.url).host, 200],
  ])) {
    const [response] = await once(get(session.url, { headers: { host } }), 'response');
    response.resume();
    expect(response.statusCode).toBe(status);
  }
  await studio.show(browser, session.url);
  const question = studio.page?.locator('#question') ?? fail();
  await expect(question).toContainText('times as long, then photograph again');
  studio.light = 1;
  await studio.page?.click('#again');
  await expect.poll(() => studio.attempts.size).toBeGreaterThan(3);
  await expect(question).toBeHidden();
  session.program.kill('SIGINT');
  expect((await session.ended).code).toBe(130);
});

/** @returns {never} */
function fail() {
  throw new Error('there is no page');
}
