/** What tests that run in every browser ask of one. Playwright's pages are such pages as they are. */

import type { TestContext } from 'node:test';
import type { Keyboard, Locator, Mouse, Page } from 'playwright-core';

/** A page, in any browser. Functions that are evaluated see nothing of what is around them. */
export interface AnyPage extends Pick<Page, 'evaluate' | 'waitForFunction'> {
  readonly mouse: Pick<Mouse, 'move' | 'down' | 'up'>;
  readonly keyboard: Pick<Keyboard, 'press'>;
  locator(selector: string): Pick<Locator, 'screenshot'>;
}

/** A browser with which tests run. */
export interface AnyBrowser {
  /** Opens a page that closes when the test ends, and fails the test where it complains of anything. */
  open(test: TestContext, path: string): Promise<AnyPage>;
}
