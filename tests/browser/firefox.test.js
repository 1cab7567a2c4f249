/** The shared tests in Firefox: all back ends, in software. */

import { after, test } from 'node:test';
import { testsIn } from './everywhere.js';
import { launchFirefox } from './firefox.js';
import { missingBrowser } from './missing-browser.js';

const executable = process.env['FIREFOX'];
if (executable) {
  const firefox = await launchFirefox(executable);
  after(() => firefox.close());
  test(`in ${firefox.name}`, () => {});
  testsIn(firefox, {
    backends: ['webgpu', 'webgl2', 'cpu'],
    missing: [],
    screenshots: true,
    namesGpus: true,
  });
} else {
  missingBrowser('Firefox', 'FIREFOX', 'firefox-esr xvfb');
}
