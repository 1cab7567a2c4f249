/**
 * The tests of every browser, in WebKitGTK. It has no WebGPU and calls every GPU "Apple GPU". Its screenshots are black
 * without a GPU, so the tests read pictures only from `toBlob`.
 */

import { testEveryBrowser } from './every-browser.js';
import { test as baseTest, expect } from './fixtures.js';
import { launchWebKitGtk } from './webkitgtk-driver.js';

const driver = process.env['WEBKIT_DRIVER'];

const test = baseTest.extend<object, { webkit: Awaited<ReturnType<typeof launchWebKitGtk>> }>({
  webkit: [
    // biome-ignore lint/correctness/noEmptyPattern: Playwright reads the names of fixtures from the pattern.
    async ({}, use) => {
      const webkit = await launchWebKitGtk(driver ?? '');
      await use(webkit);
      await webkit.close();
    },
    { scope: 'worker' },
  ],
  openAnyPage: async ({ webkit, server }, use) => {
    let isOpen = false;
    await use((path) => {
      isOpen = true;
      return webkit.open(server.origin + path);
    });
    // A skipped test opens no page.
    if (isOpen) expect(await webkit.leavePage(), 'the page must not report errors').toEqual([]);
  },
});

testEveryBrowser(test, {
  missingProgram: driver
    ? null
    : 'WebKitGTK: apt-get install webkit2gtk-driver xvfb, or set WEBKIT_DRIVER',
  backends: ['webgl2', 'cpu'],
  missingBackends: ['webgpu'],
  canReadScreen: false,
  hasRendererNames: false,
});
