/**
 * Playwright's `test` and `expect` with what all browser tests use: a server for each worker process, pages that
 * report their errors, and the comparison of pictures.
 */

import {
  type BrowserContext,
  type BrowserContextOptions,
  test as base,
  expect as baseExpect,
  type Page,
} from '@playwright/test';
import { compare, type Picture } from '../../www/tools/pictures.js';
import type { OpenAnyPage } from './any-browser.js';
import { mountPhoto, waitForLoad } from './page-helpers.js';
import { startTestServer, type TestServer } from './test-server.js';
import { openVirtualDisplay } from './virtual-display.js';

export interface PageOptions extends BrowserContextOptions {
  /** Runs in the page before its own scripts. */
  before?: () => void;
  /** Replaces timers, animation frames and time stamps, so that `page.clock` can move the time forward. */
  fakeClock?: boolean;
  /** Console messages about policies that the test expects. */
  expectedMessages?: RegExp;
}

/** Opens a page in a context of its own. The test fails when the page throws or a policy refuses something. */
export type OpenPage = (path: string, options?: PageOptions) => Promise<Page>;

/** Opens a page with one element that has these attributes, and waits until it has loaded. */
export type OpenPhoto = (
  attributes: Record<string, string>,
  options?: PageOptions,
) => Promise<Page>;

/** Runs a named check. A failed check fails the test, but only after the test's other checks. */
export type Step = (name: string, check: () => unknown) => Promise<void>;

interface TestFixtures {
  openPage: OpenPage;
  /** For checks that share a page, because loading it is what takes most of a test's time. */
  step: Step;
  openPhoto: OpenPhoto;
  /** For tests that run in every browser: `openPage`, unless Playwright cannot control the browser. */
  openAnyPage: OpenAnyPage;
}

export interface WorkerOptions {
  /** Whether the browser needs a display for WebGL. */
  needsDisplay: boolean;
}

interface WorkerFixtures extends WorkerOptions {
  server: TestServer;
  display: undefined;
}

/** Messages that no page may log, whatever its level. */
const FORBIDDEN_MESSAGES = /Content Security Policy|panicked/;
/** Longest wait of an action or an expectation. */
const FAILED_STEP_MS = 120_000;

export const test = base.extend<TestFixtures, WorkerFixtures>({
  server: [
    // biome-ignore lint/correctness/noEmptyPattern: Playwright reads the names of fixtures from the pattern.
    async ({}, use) => {
      const server = await startTestServer();
      await use(server);
      await server.close();
    },
    { scope: 'worker' },
  ],
  needsDisplay: [false, { scope: 'worker', option: true }],
  // Automatic, so that `DISPLAY` is set before the browser starts.
  display: [
    async ({ needsDisplay }, use) => {
      const display = needsDisplay ? await openVirtualDisplay() : undefined;
      if (display) process.env['DISPLAY'] = display.display;
      await use(undefined);
      await display?.close();
    },
    { scope: 'worker', auto: true },
  ],
  openPage: async ({ browser, browserName, server }, use) => {
    const contexts: BrowserContext[] = [];
    const faults: string[] = [];
    await use(async (path, { before, fakeClock, expectedMessages, ...options } = {}) => {
      const context = await browser.newContext({ baseURL: server.origin, ...options });
      contexts.push(context);
      const page = await context.newPage();
      page.on('pageerror', (error) => faults.push(String(error)));
      page.on('console', (message) => {
        const text = message.text();
        if (expectedMessages?.test(text)) return;
        const isError = browserName === 'firefox' && message.type() === 'error';
        if (isError || FORBIDDEN_MESSAGES.test(text)) faults.push(text);
      });
      if (fakeClock) await page.clock.install();
      if (before) await page.addInitScript(before);
      await page.goto(path);
      return page;
    });
    for (const context of contexts) {
      for (const page of context.pages().filter((page) => page.url().endsWith('/monitored'))) {
        faults.push(...(await page.evaluate<string[]>('complaints')));
      }
      await context.close();
    }
    baseExpect(faults, 'the page must not report errors').toEqual([]);
  },
  // biome-ignore lint/correctness/noEmptyPattern: Playwright reads the names of fixtures from the pattern.
  step: async ({}, use) => {
    const failures: string[] = [];
    await use(async (name, check) => {
      try {
        await test.step(name, async () => check());
      } catch (error) {
        failures.push(`${name}: ${error instanceof Error ? error.stack : error}`);
        // What the check waited for in vain is not taken from the next checks.
        test.setTimeout(test.info().timeout + FAILED_STEP_MS);
      }
    });
    baseExpect(failures.join('\n\n'), 'steps that failed').toBe('');
  },
  openAnyPage: async ({ openPage }, use) => use((path) => openPage(path)),
  openPhoto: async ({ openPage }, use) => {
    await use(async (attributes, options) => {
      const page = await openPage('/plain', options);
      await mountPhoto(page, attributes);
      await waitForLoad(page);
      return page;
    });
  },
});

export const expect = baseExpect.extend({
  /** Compares every code of two pictures, out of 255. */
  toMatchPicture(actual: Picture, expected: Picture, maxDifference: number) {
    const { worst, psnr } = compare(actual, expected);
    return {
      pass: worst <= maxDifference,
      message: () =>
        `pictures differ by up to ${worst}/255 (PSNR ${psnr.toFixed(1)} dB); ` +
        `expected ${this.isNot ? 'more than' : 'at most'} ${maxDifference}/255`,
    };
  },
});

/** Adds a measured figure to the test's report. */
export function note(description: string) {
  test.info().annotations.push({ type: 'measured', description });
}
