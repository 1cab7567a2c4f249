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

/** By default Firefox has WebGPU switched off on Linux, and both WebGPU and WebGL with a software renderer. */
const FIREFOX_PREFERENCES = {
  'dom.webgpu.enabled': true,
  'gfx.webgpu.ignore-blocklist': true,
  'webgl.force-enabled': true,
};
const chromium = {
  testIgnore: ['firefox.spec.js', 'webkitgtk.spec.ts'],
  use: {
    browserName: 'chromium' as const,
    launchOptions: chromiumOptions('--font-render-hinting=none'),
  },
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
  reporter: 'list',
  use: {
    actionTimeout: 60_000,
    navigationTimeout: 60_000,
    // Without screenshots and DOM snapshots, which slow down and have no canvas.
    trace: { mode: 'retain-on-failure', screenshots: false, snapshots: false },
  },
  projects: [
    { name: 'chromium', grepInvert: /webgpu/i, ...chromium },
    // SwiftShader's WebGPU uses all cores, so these tests run one at a time, and its first frame in each quality can
    // take half a minute. `grep` also reads the project's name.
    {
      name: 'chromium-serial',
      grep: /webgpu/i,
      workers: 1,
      timeout: 300_000,
      expect: { timeout: 120_000 },
      testIgnore: chromium.testIgnore,
      use: { ...chromium.use, actionTimeout: 120_000 },
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
    { name: 'webkitgtk', testMatch: 'webkitgtk.spec.ts', workers: 1 },
  ],
});
