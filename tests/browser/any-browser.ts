/** A page in any browser, as the tests that run in every browser use it. Playwright's pages have this interface. */

import type { Keyboard, Locator, Mouse, Page } from '@playwright/test';

/** Functions that are evaluated in the page cannot use variables of the test. */
export interface AnyPage extends Pick<Page, 'evaluate' | 'waitForFunction'> {
  readonly mouse: Pick<Mouse, 'move' | 'down' | 'up'>;
  readonly keyboard: Pick<Keyboard, 'press'>;
  locator(selector: string): Pick<Locator, 'screenshot'>;
}

/** Opens a page of the test server. The test fails when the page reports an error. */
export type OpenAnyPage = (path: string) => Promise<AnyPage>;
