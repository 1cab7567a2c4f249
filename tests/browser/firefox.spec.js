/** The tests of every browser, in Firefox. It has all three backends, with software renderers. */

import { testEveryBrowser } from './every-browser.js';
import { test } from './fixtures.js';

testEveryBrowser(test, {
  missingProgram: process.env['FIREFOX']
    ? null
    : 'Firefox: apt-get install firefox-esr xvfb, or set FIREFOX',
  backends: ['webgpu', 'webgl2', 'cpu'],
  missingBackends: [],
  canReadScreen: true,
  hasRendererNames: true,
});
