/**
 * The shared tests in WebKitGTK. It has no WebGPU, calls every GPU an Apple GPU, and its screenshots are
 * black on a screen without a GPU, so what it draws is looked at, but not what is on the screen.
 */

import { after, test } from 'node:test';
import { testsIn } from './everywhere.js';
import { missingBrowser } from './missing-browser.js';
import { launchWebKitGtk } from './webkitgtk.js';

const driver = process.env['WEBKIT_DRIVER'];
if (driver) {
  const webkit = await launchWebKitGtk(driver);
  after(() => webkit.close());
  test(`in ${webkit.name}`, () => {});
  testsIn(webkit, {
    backends: ['webgl2', 'cpu'],
    missing: ['webgpu'],
    screenshots: false,
    namesGpus: false,
  });
} else {
  missingBrowser('WebKitGTK', 'WEBKIT_DRIVER', 'webkit2gtk-driver xvfb');
}
