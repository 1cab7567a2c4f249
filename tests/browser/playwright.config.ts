/**
 * The browser tests: `playwright test -c tests/browser`, with the environment of pkg-scripts/env.sh, which names the
 * browsers' programs. Playwright's own browsers are not installed.
 *
 * Firefox runs over WebDriver BiDi (channel `moz-firefox`). Playwright 1.65 sends it the command
 * `emulation.setMediaFeaturesOverride`, which Firefox ESR 153 does not know, so package.json stays at 1.64.
 */

import { defineConfig } from '@playwright/test';
import { chromiumOptions } from '../../www/tools/chromium.js';
import type { WorkerOptions } from './fixtures.js';

/** Matches the titles of tests that use WebGPU. */
const WEBGPU = /webgpu/i;
/** Tag of tests that differ between the whole browser and its headless shell: the shell smooths text differently. */
const WHOLE_BROWSER = /@whole-browser/;

/** By default Firefox has WebGPU switched off on Linux, and both WebGPU and WebGL with a software renderer. */
const FIREFOX_PREFERENCES = {
  'dom.webgpu.enabled': true,
  'gfx.webgpu.ignore-blocklist': true,
  'webgl.force-enabled': true,
};
const testIgnore = ['firefox.spec.js', 'webkitgtk.spec.ts'];
const wholeChromium = chromiumOptions('--font-render-hinting=none');
// The shell has the same engine without the browser's windows, and needs two thirds of the processor time; half, if
// SwiftShader draws the canvases alone and not the pages around them.
const headlessShell = {
  ...wholeChromium,
  executablePath: process.env['HEADLESS_SHELL'] || wholeChromium.executablePath,
  args: [...wholeChromium.args, '--disable-gpu-compositing'],
};
const results = '../../target/browser-tests';

export default defineConfig<object, WorkerOptions>({
  testDir: '.',
  testMatch: '*.spec.{js,ts}',
  outputDir: `${results}/results`,
  snapshotPathTemplate: '../fixtures/visual/{arg}{ext}',
  globalSetup: './global-setup.js',
  fullyParallel: true,
  workers: 2,
  // Long enough for a machine that compiles Rust meanwhile.
  timeout: 120_000,
  expect: { timeout: 30_000 },
  forbidOnly: Boolean(process.env['CI']),
  // The report lists a test that passes the second time as flaky, with the error of the first.
  retries: process.env['CI'] ? 1 : 0,
  reporter: 'list',
  use: {
    actionTimeout: 60_000,
    navigationTimeout: 60_000,
    // Without screenshots and DOM snapshots, which slow down and have no canvas.
    trace: { mode: 'retain-on-failure', screenshots: false, snapshots: false },
  },
  projects: [
    // First, so that Chromium's tests keep the other worker busy meanwhile.
    { name: 'webkitgtk', testMatch: 'webkitgtk.spec.ts', workers: 1 },
    {
      name: 'chromium',
      testIgnore,
      grepInvert: [WEBGPU, WHOLE_BROWSER],
      use: { browserName: 'chromium', launchOptions: headlessShell },
    },
    // SwiftShader's WebGPU uses all cores, so these tests run one at a time, and its first frame in each quality can
    // take half a minute.
    {
      name: 'chromium-serial',
      testIgnore,
      grep: [WEBGPU, WHOLE_BROWSER],
      workers: 1,
      timeout: 300_000,
      expect: { timeout: 120_000 },
      use: { browserName: 'chromium', launchOptions: wholeChromium, actionTimeout: 120_000 },
    },
    {
      name: 'firefox',
      testMatch: 'firefox.spec.js',
      use: {
        browserName: 'firefox',
        channel: 'moz-firefox',
        launchOptions: {
          executablePath: process.env['FIREFOX'] ?? '',
          firefoxUserPrefs: FIREFOX_PREFERENCES,
        },
        needsDisplay: Boolean(process.env['FIREFOX']),
      },
    },
  ],
});
